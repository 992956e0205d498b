#pragma once

#include <holdfast/pcl/conversions.h>
#include <holdfast/pcl/impl/input_check.hpp>
#include <holdfast/pcl/impl/sac_engine.h>
#include <holdfast/pcl/sac_model_patch.h>
#include <holdfast/validation/residual.h>

#include <pcl/console/print.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

namespace holdfast {

template <typename PointT>
SampleConsensusModelPatch<PointT>::SampleConsensusModelPatch(
    SurfaceRequest surface,
    const PointCloudConstPtr& cloud,
    bool random)
: SampleConsensusModelPatch(surface, cloud, pcl::Indices(), random)
{}

// Not the base's constructors with a cloud: they read it before it can be checked.
template <typename PointT>
SampleConsensusModelPatch<PointT>::SampleConsensusModelPatch(
    SurfaceRequest surface,
    const PointCloudConstPtr& cloud,
    const pcl::Indices& indices,
    bool random)
: Base(random), engine_(std::make_unique<PatchConsensus>(surface))
{
  model_name_ = "SampleConsensusModelPatch";
  sample_size_ = engine_->sampleSize();
  model_size_ = engine_->modelSize();
  this->setIndices(indices);
  SampleConsensusModelPatch::setInputCloud(cloud);
}

template <typename PointT>
SampleConsensusModelPatch<PointT>::~SampleConsensusModelPatch() = default;

template <typename PointT>
void
SampleConsensusModelPatch<PointT>::setNoiseModel(const NoiseModel::ConstPtr& noise)
{
  Sensor sensor;
  sensor.noise = noise;
  setSensor(sensor);
}

template <typename PointT>
void
SampleConsensusModelPatch<PointT>::setSensor(const Sensor& sensor)
{
  engine_->setSensor(sensor);
  noticed_.reset();
}

template <typename PointT>
const ConsensusOptions&
SampleConsensusModelPatch<PointT>::getOptions() const
{
  return engine_->options();
}

template <typename PointT>
SurfaceRequest
SampleConsensusModelPatch<PointT>::getSurface() const
{
  return engine_->surface();
}

template <typename PointT>
pcl::SacModel
SampleConsensusModelPatch<PointT>::getModelType() const
{
  return static_cast<pcl::SacModel>(engine_->modelType());
}

template <typename PointT>
void
SampleConsensusModelPatch<PointT>::setInputCloud(const PointCloudConstPtr& cloud)
{
  if (!cloud) {
    PCL_ERROR("[holdfast::%s::setInputCloud] No input cloud!\n",
              getClassName().c_str());
    return;
  }
  Base::setInputCloud(cloud);
  range_ = toRangeCloud<PointT>(cloud);
  updateCloud();
}

template <typename PointT>
void
SampleConsensusModelPatch<PointT>::setInputCovariances(
    const CovariancesConstPtr& covariances)
{
  covariances_ = covariances;
  updateCloud();
}

template <typename PointT>
void
SampleConsensusModelPatch<PointT>::setSensorPose(const std::optional<Pose>& pose)
{
  sensor_pose_ = pose;
  updateCloud();
}

template <typename PointT>
void
SampleConsensusModelPatch<PointT>::updateCloud()
{
  if (!input_)
    return;
  RangeCloud cloud = range_;
  if (covariances_)
    cloud.covariances = covariances_;
  if (sensor_pose_)
    cloud.sensor_pose = *sensor_pose_;
  engine_->setCloud(cloud);
  noticed_.reset();
}

template <typename PointT>
void
SampleConsensusModelPatch<PointT>::setOptions(const ConsensusOptions& options)
{
  const std::string error = validityError(options.fit);
  if (!error.empty()) {
    PCL_ERROR("[holdfast::%s::setOptions] %s!\n",
              getClassName().c_str(),
              error.c_str());
    return;
  }
  engine_->setOptions(options);
  noticed_.reset();
}

template <typename PointT>
ConsensusDistance
SampleConsensusModelPatch<PointT>::getDistanceUnit() const
{
  return engine_->distanceUnit();
}

template <typename PointT>
ConsensusLimits
SampleConsensusModelPatch<PointT>::limits(double threshold) const
{
  return {threshold, radius_min_, radius_max_};
}

// True once for the same limits and input.
template <typename PointT>
bool
SampleConsensusModelPatch<PointT>::isNew(const ConsensusLimits& limits) const
{
  const std::array<double, 3> key{limits.threshold,
                                  limits.radius_min_m,
                                  limits.radius_max_m};
  const std::lock_guard<std::mutex> lock(notice_mutex_);
  // Bytes, so that NaN is like NaN.
  if (noticed_ && std::memcmp(noticed_->data(), key.data(), sizeof key) == 0)
    return false;
  noticed_ = key;
  return true;
}

template <typename PointT>
std::vector<std::string>
SampleConsensusModelPatch<PointT>::getNotices(double threshold) const
{
  isNew(limits(threshold));
  if (!input_)
    return {"no input cloud"};
  return engine_->doubts(limits(threshold), *indices_);
}

template <typename PointT>
void
SampleConsensusModelPatch<PointT>::warnOnce(double threshold) const
{
  if (!isNew(limits(threshold)) || !misuse().empty())
    return;
  for (const std::string& doubt : engine_->doubts(limits(threshold), *indices_))
    PCL_WARN("[holdfast::%s] %s\n", getClassName().c_str(), doubt.c_str());
}

template <typename PointT>
std::string
SampleConsensusModelPatch<PointT>::explainNothing(double threshold) const
{
  const std::string error = misuse();
  if (!error.empty())
    return "no patch: " + error;
  return engine_->explainNothing(limits(threshold), *indices_);
}

template <typename PointT>
std::string
SampleConsensusModelPatch<PointT>::misuse() const
{
  if (!input_)
    return "no input cloud";
  if (!engine_->inputError().empty())
    return engine_->inputError();
  const std::string error = detail::inputError(*input_, *indices_);
  return error.empty() ? engine_->sampleError(*indices_) : error;
}

template <typename PointT>
void
SampleConsensusModelPatch<PointT>::getSamples(int& iterations, pcl::Indices& samples)
{
  samples.clear();
  const std::string error = misuse();
  if (error.empty())
    Base::getSamples(iterations, samples);
  else
    PCL_ERROR("[holdfast::%s::getSamples] %s!\n",
              getClassName().c_str(),
              error.c_str());
}

template <typename PointT>
bool
SampleConsensusModelPatch<PointT>::isSampleGood(const pcl::Indices& samples) const
{
  return engine_->isSample(samples);
}

template <typename PointT>
bool
SampleConsensusModelPatch<PointT>::isModelValid(
    const Eigen::VectorXf& model_coefficients) const
{
  return validSurface(model_coefficients).has_value();
}

template <typename PointT>
std::optional<Patch>
SampleConsensusModelPatch<PointT>::validSurface(
    const Eigen::VectorXf& model_coefficients) const
{
  if (!Base::isModelValid(model_coefficients))
    return std::nullopt;
  const std::optional<Patch> surface = engine_->surfaceFrom(model_coefficients);
  if (!surface || surface->type.surface == SurfaceType::Plane)
    return surface;
  const double curvature = surface->principalCurvatures().cwiseAbs().maxCoeff();
  const double radius =
      curvature > 0.0 ? 1.0 / curvature : std::numeric_limits<double>::max();
  const bool within = radius >= radius_min_ && radius <= radius_max_ &&
                      curvature <= engine_->options().fit.max_curvature_per_m;
  return within ? surface : std::nullopt;
}

template <typename PointT>
bool
SampleConsensusModelPatch<PointT>::computeModelCoefficients(
    const pcl::Indices& samples,
    Eigen::VectorXf& model_coefficients) const
{
  const std::optional<SurfaceCoefficients> solution = engine_->solve(samples);
  // MSAC would wait forever for the distances of a model outside the user's limits.
  if (!solution || !isModelValid(*solution))
    return false;
  model_coefficients = *solution;
  return true;
}

template <typename PointT>
void
SampleConsensusModelPatch<PointT>::optimizeModelCoefficients(
    const pcl::Indices& inliers,
    const Eigen::VectorXf& model_coefficients,
    Eigen::VectorXf& optimized_coefficients) const
{
  const FitResult fit = estimatePatch(inliers, model_coefficients);
  optimized_coefficients = model_coefficients;
  if (!isUsable(fit.status))
    return;
  const Eigen::VectorXf coefficients = engine_->coefficientsOf(fit.patch);
  if (isModelValid(coefficients))
    optimized_coefficients = coefficients;
}

template <typename PointT>
FitResult
SampleConsensusModelPatch<PointT>::estimatePatch(
    const pcl::Indices& inliers,
    const Eigen::VectorXf& model_coefficients) const
{
  const std::optional<Patch> surface = validSurface(model_coefficients);
  if (surface)
    return engine_->estimatePatch(*surface, inliers);
  PCL_ERROR("[holdfast::%s::estimatePatch] Given model is invalid!\n",
            getClassName().c_str());
  return {};
}

template <typename PointT>
void
SampleConsensusModelPatch<PointT>::getDistancesToModel(
    const Eigen::VectorXf& model_coefficients,
    std::vector<double>& distances) const
{
  distances.clear();
  const std::optional<Patch> surface = validSurface(model_coefficients);
  if (!surface)
    return;
  distances = engine_->squaredDistances(*surface, *indices_);
  for (double& distance : distances)
    distance = std::sqrt(distance);
}

template <typename PointT>
void
SampleConsensusModelPatch<PointT>::selectWithinDistance(
    const Eigen::VectorXf& model_coefficients,
    double threshold,
    pcl::Indices& inliers)
{
  inliers.clear();
  error_sqr_dists_.clear();
  const std::optional<Patch> surface = validSurface(model_coefficients);
  if (!surface)
    return;
  warnOnce(threshold);
  const std::vector<double> squared = engine_->squaredDistances(*surface, *indices_);
  for (std::size_t i = 0; i < squared.size(); ++i)
    if (std::sqrt(squared[i]) <= threshold) {
      inliers.push_back((*indices_)[i]);
      error_sqr_dists_.push_back(squared[i]);
    }
}

template <typename PointT>
std::size_t
SampleConsensusModelPatch<PointT>::countWithinDistance(
    const Eigen::VectorXf& model_coefficients,
    double threshold) const
{
  const std::optional<Patch> surface = validSurface(model_coefficients);
  if (!surface)
    return 0;
  warnOnce(threshold);
  const std::vector<double> squared = engine_->squaredDistances(*surface, *indices_);
  return static_cast<std::size_t>(
      std::count_if(squared.begin(), squared.end(), [threshold](double s) {
        return std::sqrt(s) <= threshold;
      }));
}

template <typename PointT>
bool
SampleConsensusModelPatch<PointT>::doSamplesVerifyModel(
    const std::set<pcl::index_t>& indices,
    const Eigen::VectorXf& model_coefficients,
    double threshold) const
{
  const std::optional<Patch> surface = validSurface(model_coefficients);
  if (!surface)
    return false;
  const std::vector<double> squared =
      engine_->squaredDistances(*surface, pcl::Indices(indices.begin(), indices.end()));
  return std::all_of(squared.begin(), squared.end(), [threshold](double s) {
    return std::sqrt(s) <= threshold;
  });
}

template <typename PointT>
void
SampleConsensusModelPatch<PointT>::projectPoints(
    const pcl::Indices& inliers,
    const Eigen::VectorXf& model_coefficients,
    PointCloud& projected_points,
    bool copy_data_fields) const
{
  const std::optional<Patch> surface = validSurface(model_coefficients);
  if (!surface) {
    PCL_ERROR("[holdfast::%s::projectPoints] Given model is invalid!\n",
              getClassName().c_str());
    return;
  }
  projected_points = copy_data_fields ? *input_ : PointCloud(*input_, inliers);
  for (std::size_t i = 0; i < inliers.size(); ++i) {
    auto& point = projected_points[copy_data_fields ? inliers[i] : i];
    point.getVector3fMap() =
        nearestSurfacePoint(*surface, point.getVector3fMap().template cast<double>())
            .template cast<float>();
  }
}

} // namespace holdfast

#define PCL_INSTANTIATE_SampleConsensusModelPatch(T) \
  template class PCL_EXPORTS holdfast::SampleConsensusModelPatch<T>;
