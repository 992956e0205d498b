#pragma once

#include <holdfast/pcl/conversions.h>
#include <holdfast/pcl/impl/input_check.hpp>
#include <holdfast/pcl/patch_estimation.h>
#include <holdfast/pcl/patch_points.h>

#include <pcl/common/copy_point.h>
#include <pcl/common/point_tests.h>
#include <pcl/console/print.h>
#include <pcl/impl/pcl_base.hpp>
#include <pcl/kdtree/impl/kdtree_flann.hpp>
#include <pcl/search/impl/kdtree.hpp>
#include <pcl/search/impl/organized.hpp>
#include <pcl/search/impl/search.hpp>

#include <algorithm>
#include <exception>
#include <limits>
#include <utility>

namespace holdfast {

namespace detail {

template <typename PointT>
void
copyPatch(const ExtractedPatch& patch, PointT& point)
{
  pcl::copyPoint(toPatchPoint(patch), point);
  if constexpr (pcl::traits::has_curvature<PointT>::value)
    point.curvature = isAccepted(patch) ?
                          static_cast<float>(
                              patch.fit.patch.principalCurvatures().cwiseAbs().mean()) :
                          std::numeric_limits<float>::quiet_NaN();
}

} // namespace detail

template <typename PointInT, typename PointOutT>
std::string
PatchEstimation<PointInT, PointOutT>::misuse() const
{
  std::string error = detail::inputError(*input_, *indices_);
  if (error.empty() && surface_)
    error = detail::inputError(*surface_);
  if (!error.empty())
    return error;
  if (search_radius_ != 0.0 && k_ != 0)
    return "both a radius and k are set: set one of them to zero";
  if (!(search_radius_ >= 0.0) || k_ < 0)
    return "the radius and k must not be negative";
  if (uses_search_ && samplesSeeds())
    return "seeds from the sampler go with its neighbourhoods, not with a search "
           "method or surface";
  return {};
}

template <typename PointInT, typename PointOutT>
std::string
PatchEstimation<PointInT, PointOutT>::searchMisuse() const
{
  const auto finite = [](const PointInT& point) { return pcl::isFinite(point); };
  // What PCL's searches do in an empty tree is not defined.
  if (std::none_of(surface_->begin(), surface_->end(), finite))
    return "the search surface has no finite point";
  using Organized = pcl::search::OrganizedNeighbor<PointInT>;
  const auto* organized = dynamic_cast<const Organized*>(tree_.get());
  if (organized != nullptr && !(surface_->isOrganized() && organized->isValid()))
    return "an organized search needs an organized cloud from a projective camera";
  return {};
}

template <typename PointInT, typename PointOutT>
bool
PatchEstimation<PointInT, PointOutT>::initCompute()
{
  former_ = std::move(result_);
  result_ = {};
  patch_indices_.clear();
  if (!pcl::PCLBase<PointInT>::initCompute())
    return false;
  uses_search_ = tree_ || (surface_ && surface_ != input_);
  std::string error = misuse();
  if (error.empty() && uses_search_) {
    fake_tree_ = !tree_;
    if (!pcl::Feature<PointInT, PointOutT>::initCompute())
      return false;
    error = searchMisuse();
  }
  if (error.empty()) {
    try {
      extract();
      return true;
    }
    catch (const std::exception& exception) {
      error = exception.what();
    }
  }
  PCL_ERROR("[holdfast::%s::compute] %s!\n", getClassName().c_str(), error.c_str());
  deinitCompute();
  return false;
}

template <typename PointInT, typename PointOutT>
bool
PatchEstimation<PointInT, PointOutT>::deinitCompute()
{
  if (fake_tree_)
    tree_.reset();
  fake_tree_ = false;
  if (samplesSeeds())
    indices_.reset();
  return pcl::Feature<PointInT, PointOutT>::deinitCompute();
}

template <typename PointInT, typename PointOutT>
ExtractionOptions
PatchEstimation<PointInT, PointOutT>::effectiveOptions() const
{
  ExtractionOptions options = options_;
  SamplerOptions& sampler = options.sampler;
  if (k_ > 0) {
    sampler.neighborhood = Neighborhood::Knn;
    sampler.k = k_;
  }
  if (search_radius_ > 0.0) {
    sampler.radius_m = search_radius_;
    if (sampler.neighborhood == Neighborhood::Knn)
      sampler.neighborhood = Neighborhood::Patch;
  }
  return options;
}

template <typename PointInT, typename PointOutT>
RangeCloud
PatchEstimation<PointInT, PointOutT>::rangeCloud()
{
  std::string notice;
  RangeCloud cloud = toRangeCloud<PointInT>(uses_search_ ? surface_ : input_, &notice);
  if (!notice.empty())
    result_.notices.push_back(notice);
  if (sensor_pose_) {
    cloud.sensor_pose = *sensor_pose_;
    cloud.sensor_pose_given = true;
  }
  if (view_point_) {
    cloud.sensor_pose.c = *view_point_;
    cloud.sensor_pose_given = true;
  }
  if (covariances_)
    cloud.covariances = covariances_;
  return cloud;
}

template <typename PointInT, typename PointOutT>
PatchSites
PatchEstimation<PointInT, PointOutT>::sites() const
{
  PatchSites sites;
  if (samplesSeeds())
    return sites;
  sites.seeds.emplace();
  for (const int index : *indices_)
    sites.seeds->push_back(
        {index, (*input_)[index].getVector3fMap().template cast<double>()});
  if (!uses_search_)
    return sites;
  sites.search = [this](const Seed& seed, int, std::vector<int>& indices) {
    indices.clear();
    if (!seed.position.allFinite())
      return;
    thread_local pcl::Indices found;
    thread_local std::vector<float> squared_distances;
    this->searchForNeighbors(seed.index, search_parameter_, found, squared_distances);
    indices.assign(found.begin(), found.end());
    std::sort(indices.begin(), indices.end());
  };
  return sites;
}

template <typename PointInT, typename PointOutT>
void
PatchEstimation<PointInT, PointOutT>::extract()
{
  const RangeCloud cloud = rangeCloud();
  ExtractionOptions options = effectiveOptions();
  options.keep_failures = true;
  // Limits choose among the sampler's seeds; the caller wants a point for each of his.
  if (!samplesSeeds())
    options.sampler = withoutLimits(options.sampler);
  std::vector<std::string> notices = std::move(result_.notices);
  const PatchSites where = sites();
  result_ = extractPatches(cloud, sensor_, options, where, std::move(former_));
  result_.notices.insert(result_.notices.begin(), notices.begin(), notices.end());
  used_sensor_pose_ = cloud.sensor_pose;
  if (keep_indices_)
    keepIndices(cloud, options, where);
  if (!samplesSeeds())
    return;
  // As indices, so that it is compute() that gives the output its size: a cloud must
  // only be resized by code compiled for the instruction set it was allocated by.
  indices_ = pcl::make_shared<pcl::Indices>();
  for (const ExtractedPatch& patch : result_.patches)
    indices_->push_back(*patch.seed_index);
}

template <typename PointInT, typename PointOutT>
void
PatchEstimation<PointInT, PointOutT>::keepIndices(const RangeCloud& cloud,
                                                  const ExtractionOptions& options,
                                                  const PatchSites& sites)
{
  for (std::vector<int>& points :
       pointsOfPatches(cloud, sensor_, options, sites, result_.patches)) {
    pcl::PointIndices& indices = patch_indices_.emplace_back();
    indices.header = (uses_search_ ? surface_ : input_)->header;
    indices.indices.assign(points.begin(), points.end());
  }
}

template <typename PointInT, typename PointOutT>
void
PatchEstimation<PointInT, PointOutT>::computeFeature(PointCloudOut& output)
{
  // As many seeds as there are pixels would pass for an image of them.
  if (samplesSeeds()) {
    output.width = static_cast<std::uint32_t>(output.size());
    output.height = 1;
  }
  const std::vector<ExtractedPatch>& patches = result_.patches;
  for (std::size_t i = 0; i < patches.size(); ++i)
    detail::copyPatch(patches[i], output[i]);
  output.is_dense = std::all_of(patches.begin(), patches.end(), isAccepted);
  writeSensorPose(used_sensor_pose_, output);
}

} // namespace holdfast

#define PCL_INSTANTIATE_PatchEstimation(T, OutT) \
  template class PCL_EXPORTS holdfast::PatchEstimation<T, OutT>;
