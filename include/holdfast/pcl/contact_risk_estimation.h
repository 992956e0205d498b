/// \file Contact risk of patches as a PCL feature.
#pragma once

#include <holdfast/contact/foot.h>
#include <holdfast/pcl/foothold_point.h>
#include <holdfast/pcl/point_types.h>

#include <pcl/features/feature.h>

#include <string>

namespace holdfast {

/// What may go wrong when a foot is put in the middle of each patch of a cloud, as
/// PatchEstimation or toPatchCloud(PatchMap) make them:
///
///   ContactRiskEstimation estimation;
///   estimation.setInputCloud(patches);
///   estimation.setFoot(loadFoot("point_foot"));
///   estimation.setLoadDirection({0.0, 0.0, -1.0});
///   estimation.compute(footholds);
///
/// The output has one point for each index, at the yaw that is best there (bestYaw());
/// where there is no foothold it is NaN, `status` tells why, and the cloud is not
/// dense. A patch counts as seen all over its boundary. The numbers take
/// kRiskAssumptions for granted. The search settings of pcl::Feature do not matter.
///
/// Misuse (no input, a foot or a load that makes no sense, indices out of range) is
/// reported by PCL_ERROR, and the output is empty. Nothing throws.
class ContactRiskEstimation : public pcl::Feature<PatchPoint, FootholdPoint> {
public:
  using Ptr = pcl::shared_ptr<ContactRiskEstimation>;
  using ConstPtr = pcl::shared_ptr<const ContactRiskEstimation>;

  ContactRiskEstimation()
  {
    feature_name_ = "ContactRiskEstimation";
  }

  /// Required.
  void setFoot(const Foot& foot)
  {
    foot_ = foot;
  }

  const Foot& getFoot() const
  {
    return foot_;
  }

  /// As Placement::load_direction, frame of the cloud; -z unless set.
  void setLoadDirection(const Eigen::Vector3d& direction)
  {
    load_direction_ = direction;
  }

  /// Directions of the sole that are tried, over a full turn; 16 unless set.
  void setNumberOfYaws(int yaws)
  {
    yaws_ = yaws;
  }

  /// 0: all cores. The result does not depend on it.
  void setNumberOfThreads(unsigned int threads)
  {
    threads_ = static_cast<int>(threads);
  }

protected:
  bool initCompute() override;
  void computeFeature(PointCloudOut& output) override;

private:
  std::string inputError() const;

  Foot foot_;
  Eigen::Vector3d load_direction_ = -Eigen::Vector3d::UnitZ();
  int yaws_ = 16;
  int threads_ = 0;
};

} // namespace holdfast
