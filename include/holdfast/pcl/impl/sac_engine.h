/// \file What SampleConsensusModelPatch and PatchSegmentation do, for any point type.
/// An implementation detail: programs need SampleConsensusModelPatch alone.
#pragma once

#include <holdfast/pcl/consensus_options.h>
#include <holdfast/pcl/range_cloud.h>
#include <holdfast/sensor/sensor.h>

#include <pcl/types.h>

#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace holdfast {

/// The coefficients of a model, eight at most, in memory that is the same for any
/// instruction set.
using SurfaceCoefficients =
    Eigen::Matrix<float, Eigen::Dynamic, 1, Eigen::DontAlign, 8, 1>;

/// What a search is told to keep.
struct ConsensusLimits {
  double threshold = 0.0; ///< of distances, in their unit
  double radius_min_m = -std::numeric_limits<double>::max(); ///< PCL's "no limit"
  double radius_max_m = std::numeric_limits<double>::max();
};

/// A cloud, the noise of its points, and one kind of surface to look for in it.
///
/// Indices outside the cloud and points that are not finite are in no sample; they, and
/// points without a usable covariance, are at an infinite distance from every surface.
/// Every const function may be called from many threads.
class PatchConsensus {
public:
  explicit PatchConsensus(SurfaceRequest surface);
  ~PatchConsensus();
  PatchConsensus(PatchConsensus&&) noexcept;
  PatchConsensus& operator=(PatchConsensus&&) noexcept;

  /// Covariances of the cloud go before the noise model.
  void setCloud(const RangeCloud& cloud);

  /// Distances go by the noise of single points, the covariance of the refined model by
  /// the pattern as well. Without noise nothing is known but that the noise of all
  /// points is the same in all directions. Its size then comes from the distances of
  /// the inliers.
  void setSensor(const Sensor& sensor);

  /// \throw std::invalid_argument when the options make no sense.
  void setOptions(const ConsensusOptions& options);
  const ConsensusOptions& options() const;

  /// Empty when cloud and covariances can be worked on, else what is wrong.
  const std::string& inputError() const;

  SurfaceRequest surface() const;
  int modelType() const;
  unsigned int sampleSize() const;
  unsigned int modelSize() const;

  /// Empty when the indices hold as many finite points as a sample takes, else what is
  /// missing.
  std::string sampleError(const pcl::Indices& indices) const;

  /// What distances are in: metres, too, where nothing is known of the noise.
  ConsensusDistance distanceUnit() const;

  /// What is doubtful about the cloud, its noise and the limits, one line each: what
  /// was given, what was expected, the likely cause. Looks at the whole cloud once.
  std::vector<std::string> doubts(const ConsensusLimits& limits,
                                  const pcl::Indices& indices) const;

  /// Why a search found nothing, in one line.
  std::string explainNothing(const ConsensusLimits& limits,
                             const pcl::Indices& indices) const;

  /// True for as many points as a sample has, all of them finite.
  bool isSample(const pcl::Indices& sample) const;

  /// Coefficients of the surface through a minimal sample; nothing where the points do
  /// not determine one.
  std::optional<SurfaceCoefficients> solve(const pcl::Indices& sample) const;

  /// The unbounded surface (d = 0) of coefficients; nothing when they are not finite,
  /// of another number than modelSize(), or make no surface of this kind.
  std::optional<Patch> surfaceFrom(const Eigen::VectorXf& coefficients) const;

  /// Coefficients of a patch that was fitted to this kind of surface.
  SurfaceCoefficients coefficientsOf(const Patch& patch) const;

  /// Squared distances of the points to an unbounded surface, in the order of the
  /// indices.
  std::vector<double> squaredDistances(const Patch& surface,
                                       const pcl::Indices& indices) const;

  /// The weighted fit of a bounded patch to inliers of a surface.
  FitResult estimatePatch(const Patch& surface, const pcl::Indices& inliers) const;

private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

} // namespace holdfast
