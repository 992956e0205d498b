/// \file From a cloud to the covariance of the noise of every point.
#pragma once

#include <holdfast/pcl/point_types.h>
#include <holdfast/pcl/range_cloud.h>
#include <holdfast/sensor/sensor.h>

#include <pcl/features/feature.h>

#include <optional>

namespace holdfast {

/// The covariances that a noise model gives points of a cloud, in the frame of the
/// cloud, from its sensor pose. Organized clouds are taken as images by models in which
/// a pixel's noise depends on its neighbours (NoiseModel::imageCovariances).
/// \param indices of the points wanted; \return one matrix for each, NaN for points
/// that are not finite or that the sensor cannot have seen.
Covariances rangeCovariances(const RangeCloud& cloud,
                             const NoiseModel::ConstPtr& noise,
                             const pcl::Indices& indices);

/// Covariances of range measurements, as a PCL feature: setInputCloud(), setIndices(),
/// setNoiseModel(), compute(). The search settings of pcl::Feature do not matter.
///
/// The model is evaluated at the measured points. Where only patches are wanted, better
/// give the model to PatchEstimation, which evaluates it at the surface: at points that
/// are too near by chance, it makes them too certain.
///
/// \tparam PointOutT has x, y, z and setCovariance(), as PointXYZCovariance has.
template <typename PointInT, typename PointOutT = PointXYZCovariance>
class RangeCovarianceEstimation : public pcl::Feature<PointInT, PointOutT> {
public:
  using Ptr = pcl::shared_ptr<RangeCovarianceEstimation<PointInT, PointOutT>>;
  using ConstPtr =
      pcl::shared_ptr<const RangeCovarianceEstimation<PointInT, PointOutT>>;
  using PointCloudOut = typename pcl::Feature<PointInT, PointOutT>::PointCloudOut;

  RangeCovarianceEstimation()
  {
    feature_name_ = "RangeCovarianceEstimation";
  }

  /// Required, unless setSensor() brings one.
  void setNoiseModel(const NoiseModel::ConstPtr& noise)
  {
    noise_ = noise;
  }

  NoiseModel::ConstPtr getNoiseModel() const
  {
    return noise_;
  }

  void setSensor(const Sensor& sensor)
  {
    setNoiseModel(sensor.noise);
  }

  /// Where the sensor stood, q_cloud = R q_camera + c, in place of what the cloud says
  /// in sensor_origin_ and sensor_orientation_ (see toRangeCloud()); nothing: the cloud
  /// decides again.
  void setSensorPose(const std::optional<Pose>& pose)
  {
    sensor_pose_ = pose;
  }

  /// Covariances to stand beside the cloud (PatchEstimation::setInputCovariances): one
  /// per point of the input cloud, NaN for points outside the indices and those that
  /// compute() has none for. Empty on misuse, which is reported as by compute().
  void computeCovariances(Covariances& output);

protected:
  using pcl::Feature<PointInT, PointOutT>::feature_name_;
  using pcl::Feature<PointInT, PointOutT>::indices_;
  using pcl::Feature<PointInT, PointOutT>::input_;
  using pcl::Feature<PointInT, PointOutT>::getClassName;

  bool initCompute() override;

private:
  Covariances covariancesOfIndices() const;
  void computeFeature(PointCloudOut& output) override;

  NoiseModel::ConstPtr noise_;
  std::optional<Pose> sensor_pose_;

public:
  PCL_MAKE_ALIGNED_OPERATOR_NEW
};

} // namespace holdfast

#ifdef PCL_NO_PRECOMPILE
#include <holdfast/pcl/impl/range_covariance_estimation.hpp>
#endif
