/// \file The road from a cloud to patches: covariances, neighbourhoods, fits.
#pragma once

#include <holdfast/patch_estimator.h>
#include <holdfast/pcl/neighborhood_sampler.h>
#include <holdfast/progress.h>
#include <holdfast/validation/checks.h>

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace holdfast {

struct ExtractionOptions {
  SamplerOptions sampler;
  /// fit.viewpoint is set from the cloud's sensor pose.
  FitOptions fit;
  CovarianceMode covariance = CovarianceMode::Exact;
  /// Limits that turn patches down; without any, patches are only measured, and with
  /// nothing here, which saves a fifth of the time of a fit, not even that.
  std::optional<ValidationOptions> validation;
  int threads = 0; ///< 0: all cores
  /// Called now and then with (done, total); from one thread at a time.
  Progress progress;
};

/// One fitted patch and where it came from.
struct ExtractedPatch {
  FitResult fit;
  std::optional<Validation> validation; ///< if asked for
  /// Index and position of the seed; nothing when all points were fitted at once.
  std::optional<int> seed_index;
  Eigen::Vector3d seed = Eigen::Vector3d::Zero();
  double radius_m = 0.0; ///< of the neighbourhood; 0: there was none
};

/// True when the fit came out and validation, if asked for, did not turn it down.
bool isAccepted(const ExtractedPatch& patch);

struct ExtractionResult {
  std::vector<ExtractedPatch> patches; ///< accepted ones, in the order of the seeds
  /// How many seeds gave no patch, by reason, and how many patches validation turned
  /// down.
  std::map<FitStatus, int> rejected;
  std::map<PatchVerdict, int> turned_down;
  /// Finite points of the cloud left out of all fits: their covariance is indefinite or
  /// not finite, or the noise model has none for them (behind the camera).
  int invalid_covariances = 0;
  /// What the user should know, one line each.
  std::vector<std::string> notices;
};

/// Sorts attempts into accepted patches and reasons.
ExtractionResult sortOut(std::vector<ExtractedPatch> attempts);

/// A place where a patch is wanted.
struct Seed {
  int index = 0; ///< in the cloud the seeds were chosen from
  Eigen::Vector3d position = Eigen::Vector3d::Zero(); ///< frame of the cloud, m
};

/// Finds the points around a seed: indices into the cloud that is fitted, finite points
/// only. Called from several threads at once; `thread` (below their number) tells them
/// apart.
using NeighborhoodSearch =
    std::function<void(const Seed& seed, int thread, std::vector<int>& indices)>;

/// Covariances, neighbourhoods, fits, validation: what extractPatches(), which chooses
/// the seeds itself, and PatchEstimation, which is given them, have in common. Refers
/// to the cloud.
///
/// Covariances come from the cloud, else from the sensor. When most points lie where
/// that sensor cannot see (a scan from all sides, a survey), its noise means nothing:
/// 1 mm in every direction is assumed, with a notice.
class PatchExtractor {
public:
  /// \throw std::invalid_argument on options or clouds that make no sense. The sensor
  /// needs a noise model only where the cloud has no covariances.
  PatchExtractor(const RangeCloud& cloud,
                 const Sensor& sensor,
                 const ExtractionOptions& options);
  ~PatchExtractor();

  /// One attempt per seed, accepted or not, in their order, in parallel; the result
  /// does not depend on the number of threads.
  std::vector<ExtractedPatch> fitAround(const std::vector<Seed>& seeds,
                                        const NeighborhoodSearch& search) const;

  /// The same with the neighbourhoods of a sampler of this cloud.
  std::vector<ExtractedPatch> fitAround(const std::vector<int>& seeds,
                                        const NeighborhoodSampler& sampler) const;

  /// The same with the first of the seeds, until the limits that the options of the
  /// sampler set to patches, area or time are reached. Only accepted patches count; the
  /// time runs from the construction of this object.
  /// \param notice is set when seeds were left.
  std::vector<ExtractedPatch> fitWithinLimits(const std::vector<int>& seeds,
                                              const NeighborhoodSampler& sampler,
                                              std::string* notice = nullptr) const;

  /// The same with the seeds of the sampler.
  std::vector<ExtractedPatch> fitSampled(const NeighborhoodSampler& sampler,
                                         std::string* notice = nullptr) const;

  /// One attempt at all finite points.
  ExtractedPatch fitWhole() const;

  /// The sensor whose noise holds for the cloud.
  const Sensor& sensor() const;

  /// As in ExtractionResult.
  const std::vector<std::string>& notices() const;
  int countInvalidCovariances() const;

private:
  struct Impl;
  std::unique_ptr<const Impl> impl_;
};

/// The attempts of an extractor sorted out, with what it has noticed.
ExtractionResult sortOut(std::vector<ExtractedPatch> attempts,
                         const PatchExtractor& extractor);

/// Samples seeds and neighbourhoods and fits a patch to each, up to the sampler's
/// limits.
/// \throw std::invalid_argument on options or clouds that make no sense.
ExtractionResult extractPatches(const RangeCloud& cloud,
                                const Sensor& sensor,
                                const ExtractionOptions& options);

/// One patch fitted to all valid points of the cloud. `rejected` has one entry when it
/// failed.
ExtractionResult extractWhole(const RangeCloud& cloud,
                              const Sensor& sensor,
                              const ExtractionOptions& options);

} // namespace holdfast
