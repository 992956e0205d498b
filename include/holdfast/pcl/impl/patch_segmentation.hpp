#pragma once

#include <holdfast/pcl/impl/sac_model_patch.hpp>
#include <holdfast/pcl/patch_segmentation.h>

#include <pcl/console/print.h>

#include <algorithm>
#include <memory>
#include <string>
#include <utility>
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
PatchSegmentation<PointT>::reportError(const std::string& error)
{
  PCL_ERROR("[holdfast::%s::segment] %s!\n", getClassName().c_str(), error.c_str());
  notices_.push_back(error);
}

// On the screen once while calls follow each other that have the same to say.
template <typename PointT>
void
PatchSegmentation<PointT>::reportNotice(const std::string& notice)
{
  if (std::find(earlier_notices_.begin(), earlier_notices_.end(), notice) ==
      earlier_notices_.end())
    PCL_WARN("[holdfast::%s::segment] %s\n", getClassName().c_str(), notice.c_str());
  notices_.push_back(notice);
}

template <typename PointT>
void
PatchSegmentation<PointT>::segment(pcl::PointIndices& inliers,
                                   pcl::ModelCoefficients& model_coefficients)
{
  patch_ = FitResult();
  inliers.indices.clear();
  model_coefficients.values.clear();
  earlier_notices_ = std::move(notices_);
  notices_.clear();
  if (!input_)
    return reportError("no input cloud");
  if (!surfaceOfModelType(model_type_) && sigma_threshold_ && !isInMetres())
    return reportError("model type " + std::to_string(model_type_) +
                       " is not ours, and PCL's models know no sigmas: "
                       "setDistanceThreshold() in metres is expected");
  // What the base reads and hands to the model; afterwards it is the user's again.
  struct Restore {
    double& threshold;
    const double value;
    ~Restore()
    {
      threshold = value;
    }
  } const restore{threshold_, threshold_};
  unit_ = isInMetres() ? ConsensusDistance::Euclidean : ConsensusDistance::Mahalanobis;
  if (!isInMetres() && surfaceOfModelType(model_type_))
    threshold_ = getSigmaThreshold();
  search(inliers, model_coefficients);
}

template <typename PointT>
void
PatchSegmentation<PointT>::search(pcl::PointIndices& inliers,
                                  pcl::ModelCoefficients& model_coefficients)
{
  model_.reset();
  Base::segment(inliers, model_coefficients);
  if (!model_ && notices_.empty())
    notices_.push_back("PCL refused the input or model type " +
                       std::to_string(model_type_));
  const auto model = std::dynamic_pointer_cast<Model>(model_);
  if (!model)
    return;
  if (!inliers.indices.empty())
    finish(*model, inliers, model_coefficients);
  if (inliers.indices.empty()) {
    model_coefficients.values.clear();
    reportNotice(model->explainNothing(threshold_));
  }
  else if (!isUsable(patch_.status))
    reportNotice(
        "the " + std::to_string(inliers.indices.size()) +
        " inliers do not make a patch: " + std::string(statusName(patch_.status)));
}

template <typename PointT>
void
PatchSegmentation<PointT>::finish(Model& model,
                                  pcl::PointIndices& inliers,
                                  pcl::ModelCoefficients& model_coefficients)
{
  std::vector<float>& values = model_coefficients.values;
  Eigen::VectorXf coefficients =
      Eigen::VectorXf::Map(values.data(), static_cast<Eigen::Index>(values.size()));
  if (optimize_coefficients_)
    settle(model, inliers.indices, coefficients);
  std::copy(coefficients.begin(), coefficients.end(), values.begin());
  patch_ = model.estimatePatch(inliers.indices, coefficients);
}

template <typename PointT>
void
PatchSegmentation<PointT>::settle(Model& model,
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

// Empty where the model can be searched for, else what is wrong: some of PCL's methods
// would crash where others report.
template <typename PointT>
std::string
PatchSegmentation<PointT>::misuse(const Model& model) const
{
  const std::string error = model.misuse();
  if (!error.empty() || model.getDistanceUnit() == unit_)
    return error;
  const std::string noise = "a sensor, a noise model or covariances";
  if (sigma_threshold_)
    return "a threshold in sigmas takes the noise of the points: give " + noise +
           ", or setDistanceThreshold() in metres";
  return "no threshold is set: setDistanceThreshold() in metres is expected, or " +
         noise + " for 3 sigmas";
}

template <typename PointT>
bool
PatchSegmentation<PointT>::initSACModel(int model_type)
{
  model_.reset();
  const std::optional<SurfaceRequest> surface = surfaceOfModelType(model_type);
  if (!surface)
    return Base::initSACModel(model_type);
  auto model = pcl::make_shared<Model>(*surface, input_, *indices_, random_);
  ConsensusOptions options = options_;
  options.distance = unit_;
  model->setRadiusLimits(radius_min_, radius_max_);
  model->setOptions(options);
  model->setInputCovariances(covariances_);
  model->setSensorPose(sensor_pose_);
  // Last, since a model that looks at the whole image takes its time.
  model->setSensor(sensor_);
  const std::string error = misuse(*model);
  if (!error.empty()) {
    reportError(error);
    return false;
  }
  for (const std::string& notice : model->getNotices(threshold_))
    reportNotice(notice);
  model_ = model;
  return true;
}

} // namespace holdfast

#define PCL_INSTANTIATE_PatchSegmentation(T) \
  template class PCL_EXPORTS holdfast::PatchSegmentation<T>;
