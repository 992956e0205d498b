#pragma once

#include <holdfast/pcl/conversions.h>
#include <holdfast/pcl/impl/input_check.hpp>
#include <holdfast/pcl/range_covariance_estimation.h>

#include <pcl/common/point_tests.h>
#include <pcl/console/print.h>
#include <pcl/impl/pcl_base.hpp>
#include <pcl/kdtree/impl/kdtree_flann.hpp>
#include <pcl/search/impl/kdtree.hpp>
#include <pcl/search/impl/organized.hpp>
#include <pcl/search/impl/search.hpp>

#include <exception>
#include <limits>

namespace holdfast {

template <typename PointInT, typename PointOutT>
bool
RangeCovarianceEstimation<PointInT, PointOutT>::initCompute()
{
  // Not the base's: it would ask for a radius and build a search tree.
  if (!pcl::PCLBase<PointInT>::initCompute())
    return false;
  const std::string error = noise_ ? detail::inputError(*input_, *indices_) :
                                     "no noise model: setNoiseModel() or setSensor()";
  if (!error.empty())
    PCL_ERROR("[holdfast::%s::compute] %s!\n", getClassName().c_str(), error.c_str());
  return error.empty();
}

template <typename PointInT, typename PointOutT>
Covariances
RangeCovarianceEstimation<PointInT, PointOutT>::covariancesOfIndices() const
{
  RangeCloud cloud = toRangeCloud<PointInT>(input_);
  cloud.covariances.reset(); // Points that have some are to get new ones.
  if (sensor_pose_)
    cloud.sensor_pose = *sensor_pose_;
  return rangeCovariances(cloud, noise_, *indices_);
}

template <typename PointInT, typename PointOutT>
void
RangeCovarianceEstimation<PointInT, PointOutT>::computeCovariances(Covariances& output)
{
  output.clear();
  if (!initCompute())
    return;
  const Covariances found = covariancesOfIndices();
  output.assign(input_->size(),
                Eigen::Matrix3f::Constant(std::numeric_limits<float>::quiet_NaN()));
  for (std::size_t i = 0; i < found.size(); ++i)
    output[(*indices_)[i]] = found[i];
  this->deinitCompute();
}

template <typename PointInT, typename PointOutT>
void
RangeCovarianceEstimation<PointInT, PointOutT>::computeFeature(PointCloudOut& output)
{
  const Covariances covariances = covariancesOfIndices();
  output.sensor_origin_ = input_->sensor_origin_;
  output.sensor_orientation_ = input_->sensor_orientation_;
  output.is_dense = true;
  for (std::size_t i = 0; i < covariances.size(); ++i) {
    output[i].getVector4fMap() = (*input_)[(*indices_)[i]].getVector4fMap();
    output[i].setCovariance(covariances[i]);
    output.is_dense = output.is_dense && pcl::isFinite(output[i]);
  }
}

} // namespace holdfast

#define PCL_INSTANTIATE_RangeCovarianceEstimation(T, OutT) \
  template class PCL_EXPORTS holdfast::RangeCovarianceEstimation<T, OutT>;
