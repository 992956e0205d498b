#pragma once

#include <holdfast/pcl/impl/sac_model_patch.hpp>
#include <holdfast/pcl/patch_segmentation.h>

#include <pcl/console/print.h>

#include <algorithm>
#include <memory>
#include <vector>

namespace holdfast {

template <typename PointT>
PatchSegmentation<PointT>::PatchSegmentation(bool random) : Base(random)
{}

template <typename PointT>
PatchSegmentation<PointT>::~PatchSegmentation() = default;

template <typename PointT>
void
PatchSegmentation<PointT>::setOptions(const ConsensusOptions& options)
{
  const std::string error = validityError(options.fit);
  if (error.empty())
    options_ = options;
  else
    PCL_ERROR("[holdfast::%s::setOptions] %s!\n",
              getClassName().c_str(),
              error.c_str());
}

template <typename PointT>
void
PatchSegmentation<PointT>::segment(pcl::PointIndices& inliers,
                                   pcl::ModelCoefficients& model_coefficients)
{
  patch_ = FitResult();
  inliers.indices.clear();
  model_coefficients.values.clear();
  if (!input_) {
    PCL_ERROR("[holdfast::%s::segment] No input cloud!\n", getClassName().c_str());
    return;
  }
  Base::segment(inliers, model_coefficients);
  const auto model =
      std::dynamic_pointer_cast<SampleConsensusModelPatch<PointT>>(model_);
  if (!model || inliers.indices.empty())
    return;
  std::vector<float>& values = model_coefficients.values;
  Eigen::VectorXf coefficients =
      Eigen::VectorXf::Map(values.data(), static_cast<Eigen::Index>(values.size()));
  if (optimize_coefficients_)
    settle(*model, inliers.indices, coefficients);
  std::copy(coefficients.begin(), coefficients.end(), values.begin());
  patch_ = model->estimatePatch(inliers.indices, coefficients);
}

template <typename PointT>
void
PatchSegmentation<PointT>::settle(SampleConsensusModelPatch<PointT>& model,
                                  pcl::Indices& inliers,
                                  Eigen::VectorXf& coefficients) const
{
  constexpr int kMostRounds = 20; // inliers at the threshold may come and go forever
  pcl::Indices before;
  for (int round = 0; round < kMostRounds && inliers != before; ++round) {
    before = inliers;
    model.optimizeModelCoefficients(before, coefficients, coefficients);
    model.selectWithinDistance(coefficients, threshold_, inliers);
  }
}

template <typename PointT>
bool
PatchSegmentation<PointT>::initSACModel(int model_type)
{
  model_.reset();
  const std::optional<SurfaceRequest> surface = surfaceOfModelType(model_type);
  if (!surface)
    return Base::initSACModel(model_type);
  auto model = pcl::make_shared<SampleConsensusModelPatch<PointT>>(*surface,
                                                                   input_,
                                                                   *indices_,
                                                                   random_);
  model->setRadiusLimits(radius_min_, radius_max_);
  model->setOptions(options_);
  model->setInputCovariances(covariances_);
  model->setSensorPose(sensor_pose_);
  // Last, since a model that looks at the whole image takes its time.
  model->setNoiseModel(noise_);
  // Some of PCL's methods would crash where others report.
  const std::string error = model->misuse();
  if (!error.empty()) {
    PCL_ERROR("[holdfast::%s::initSACModel] %s!\n",
              getClassName().c_str(),
              error.c_str());
    return false;
  }
  model_ = model;
  return true;
}

} // namespace holdfast

#define PCL_INSTANTIATE_PatchSegmentation(T) \
  template class PCL_EXPORTS holdfast::PatchSegmentation<T>;
