/// \file From indices into a cloud to the points and covariances of a fit.
#pragma once

#include <holdfast/fit/point_batch.h>
#include <holdfast/pcl/range_cloud.h>
#include <holdfast/sensor/sensor.h>

#include <memory>
#include <vector>

namespace holdfast {

/// Copies neighbourhoods into batches, covariances from the cloud if it has any, else
/// from the noise model (at the surface, if asked). Refers to the cloud. A point that
/// the model has no covariance for gets NaN, which the fit leaves out and counts.
class PointGatherer {
public:
  PointGatherer(const RangeCloud& cloud,
                NoiseModel::ConstPtr noise,
                bool noise_at_surface);

  /// Tells batches of the errors their points share, too, where the noise is the
  /// sensor's and not the cloud's own.
  PointGatherer(const RangeCloud& cloud, const Sensor& sensor, bool noise_at_surface);

  /// Refills the batch with finite points of the cloud; `origin` (frame of the cloud)
  /// should be near them.
  void gather(const std::vector<int>& indices,
              const Eigen::Vector3d& origin,
              PointBatch& batch) const;

private:
  void gatherStored(const std::vector<int>& indices, PointBatch& batch) const;
  void gatherModelled(const std::vector<int>& indices, PointBatch& batch) const;
  void copyToCameraFrame(const std::vector<int>& indices, PointBatch& batch) const;
  void evaluateModel(PointBatch& batch) const;
  void sharePattern(PointBatch& batch) const;

  const RangeCloud& cloud_;
  NoiseModel::ConstPtr noise_;
  bool noise_at_surface_;
  Pose to_camera_;
  bool in_camera_frame_;
  Camera camera_; ///< that the pattern is seen with
  std::shared_ptr<const CorrelatedNoise> pattern_; ///< null: errors are independent
  std::vector<Eigen::Matrix3f> image_covariances_;
  /// The cloud's, or those of the image, or empty: the model is asked point by point.
  const std::vector<Eigen::Matrix3f>& stored_;
};

} // namespace holdfast
