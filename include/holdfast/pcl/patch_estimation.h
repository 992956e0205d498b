/// \file Bounded patches with covariance as a PCL feature.
#pragma once

#include <holdfast/pcl/patch_extraction.h>
#include <holdfast/pcl/point_types.h>

#include <pcl/PointIndices.h>
#include <pcl/features/feature.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace holdfast {

/// Fits a bounded patch with the covariance of its parameters around every seed:
///
///   PatchEstimation<pcl::PointXYZRGB> estimation;
///   estimation.setInputCloud(cloud);
///   estimation.setIndices(seeds);           // else every point is a seed
///   estimation.setSensor(loadSensor("kinect_v1"));
///   estimation.setRadiusSearch(0.05);
///   estimation.compute(patches);
///
/// Seeds are the indices; without any, those a NeighborhoodSampler chooses if
/// setSeedsFromSampler() asks for it, else all points.
///
/// Neighbourhoods come from a NeighborhoodSampler: the points whose rays meet the
/// surface around the seed within the radius, which is unbiased where a ball cuts the
/// noise tails; for k instead of a radius, the k nearest points. With setSearchMethod()
/// or setSearchSurface() they come from PCL's search instead, as in any feature.
///
/// The noise of the points comes from setInputCovariances(), else from the points
/// themselves (PointXYZCovariance), else from the model of the sensor. One of them is
/// needed. Where the cloud was taken from matters to the model and to the sign of the
/// normals: see setSensorPose().
///
/// The output has one point per seed. Where no patch was found, or validation turned it
/// down (as it does by default what is no patch of that radius, ValidationOptions), the
/// point is NaN, its fields `status` and `verdict` tell why, and the cloud is not
/// dense. Misuse (no input, indices out of range, radius and k both set, covariances of
/// another number than the points, ...) is reported by PCL_ERROR, and the output is
/// empty. Nothing throws.
///
/// \tparam PointOutT PatchPoint, or any point type that shares fields with it. A field
/// `curvature` (pcl::PointNormal) is the mean absolute curvature at the centre of the
/// patch, (|k1| + |k2|) / 2 in 1/m: not PCL's share of an eigenvalue.
template <typename PointInT, typename PointOutT = PatchPoint>
class PatchEstimation : public pcl::Feature<PointInT, PointOutT> {
public:
  using Ptr = pcl::shared_ptr<PatchEstimation<PointInT, PointOutT>>;
  using ConstPtr = pcl::shared_ptr<const PatchEstimation<PointInT, PointOutT>>;
  using PointCloudOut = typename pcl::Feature<PointInT, PointOutT>::PointCloudOut;

  PatchEstimation()
  {
    feature_name_ = "PatchEstimation";
  }

  void setSensor(const Sensor& sensor)
  {
    sensor_ = sensor;
  }

  const Sensor& getSensor() const
  {
    return sensor_;
  }

  /// The noise of the sensor alone; errors of the points are independent then.
  void setNoiseModel(const NoiseModel::ConstPtr& noise)
  {
    sensor_.noise = noise;
    sensor_.pattern = {};
  }

  /// Covariances beside the cloud, one per point of the search surface (which is the
  /// input cloud unless set otherwise), m^2, in its frame; null: none.
  void setInputCovariances(const CovariancesConstPtr& covariances)
  {
    covariances_ = covariances;
  }

  CovariancesConstPtr getInputCovariances() const
  {
    return covariances_;
  }

  /// Where the sensor stood, q_cloud = R q_camera + c, in place of what the cloud says
  /// in sensor_origin_ and sensor_orientation_ (see toRangeCloud()); nothing: the cloud
  /// decides again.
  void setSensorPose(const std::optional<Pose>& pose)
  {
    sensor_pose_ = pose;
    view_point_.reset();
  }

  /// The position alone, as of pcl::NormalEstimation: m, frame of the cloud. The axes
  /// stay those that the cloud says. Of this and setSensorPose() the last one holds.
  void setViewPoint(float x, float y, float z)
  {
    view_point_ = Eigen::Vector3d(x, y, z);
    sensor_pose_.reset();
  }

  /// The cloud takes the place of setViewPoint() and setSensorPose() again.
  void useSensorOriginAsViewPoint()
  {
    view_point_.reset();
    sensor_pose_.reset();
  }

  /// Everything else: fit, sampler, covariance mode, validation, threads, progress. A
  /// radius or k set by setRadiusSearch() or setKSearch() goes before the sampler's.
  void setOptions(const ExtractionOptions& options)
  {
    options_ = options;
  }

  const ExtractionOptions& getOptions() const
  {
    return options_;
  }

  void setFitOptions(const FitOptions& fit)
  {
    options_.fit = fit;
  }

  void setSamplerOptions(const SamplerOptions& sampler)
  {
    options_.sampler = sampler;
  }

  void setCovarianceMode(CovarianceMode mode)
  {
    options_.covariance = mode;
  }

  /// Limits that turn patches down; nothing: patches are not even measured.
  void setValidationOptions(const std::optional<ValidationOptions>& validation)
  {
    options_.validation = validation;
  }

  /// 0: all cores. The result does not depend on it.
  void setNumberOfThreads(unsigned int threads)
  {
    options_.threads = static_cast<int>(threads);
  }

  /// Without indices, choose the seeds as the sampler options say, up to their limits;
  /// not together with a search method or surface.
  void setSeedsFromSampler(bool from_sampler)
  {
    seeds_from_sampler_ = from_sampler;
  }

  /// Remember the points of each patch; costs the search for its neighbourhood again.
  void setKeepIndices(bool keep)
  {
    keep_indices_ = keep;
  }

  bool getKeepIndices() const
  {
    return keep_indices_;
  }

  /// With setKeepIndices(), the points that each patch of the last compute() was fitted
  /// to, ascending, one entry per point of the output; empty where there is no patch.
  /// Indices into the search surface, which is the input cloud unless set otherwise.
  const std::vector<pcl::PointIndices>& getPatchIndices() const
  {
    return patch_indices_;
  }

  /// The fits behind the points of the last compute(), one each, with everything in
  /// double precision; empty if it failed.
  const std::vector<ExtractedPatch>& getResults() const
  {
    return result_.patches;
  }

  /// The same with how many failed and why, and what became of the points.
  const ExtractionResult& getExtraction() const
  {
    return result_;
  }

  /// What the user should know about the last compute(), one line each.
  const std::vector<std::string>& getNotices() const
  {
    return result_.notices;
  }

protected:
  using pcl::Feature<PointInT, PointOutT>::fake_indices_;
  using pcl::Feature<PointInT, PointOutT>::feature_name_;
  using pcl::Feature<PointInT, PointOutT>::indices_;
  using pcl::Feature<PointInT, PointOutT>::input_;
  using pcl::Feature<PointInT, PointOutT>::k_;
  using pcl::Feature<PointInT, PointOutT>::search_parameter_;
  using pcl::Feature<PointInT, PointOutT>::search_radius_;
  using pcl::Feature<PointInT, PointOutT>::surface_;
  using pcl::Feature<PointInT, PointOutT>::tree_;
  using pcl::Feature<PointInT, PointOutT>::getClassName;

  bool initCompute() override;
  bool deinitCompute() override;

private:
  bool samplesSeeds() const
  {
    return seeds_from_sampler_ && fake_indices_;
  }
  std::string misuse() const;
  std::string searchMisuse() const;
  ExtractionOptions effectiveOptions() const;
  RangeCloud rangeCloud();
  PatchSites sites() const;
  void extract();
  void keepIndices(const RangeCloud& cloud,
                   const ExtractionOptions& options,
                   const PatchSites& sites);
  void computeFeature(PointCloudOut& output) override;

  Sensor sensor_;
  CovariancesConstPtr covariances_;
  std::optional<Pose> sensor_pose_;
  std::optional<Eigen::Vector3d> view_point_;
  ExtractionOptions options_;
  bool keep_indices_ = false;
  bool seeds_from_sampler_ = false;
  /// PCL's search, not our sampler, finds the neighbourhoods; and, if so, with a tree
  /// that the base made because the user gave none.
  bool uses_search_ = false;
  bool fake_tree_ = false;
  Pose used_sensor_pose_; ///< during compute()
  ExtractionResult result_; ///< with one entry per seed
  ExtractionResult former_; ///< whose memory the next one uses
  std::vector<pcl::PointIndices> patch_indices_;

public:
  PCL_MAKE_ALIGNED_OPERATOR_NEW
};

} // namespace holdfast

#ifdef PCL_NO_PRECOMPILE
#include <holdfast/pcl/impl/patch_estimation.hpp>
#endif
