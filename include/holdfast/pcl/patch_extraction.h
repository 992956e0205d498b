/// \file The road from a cloud to patches: covariances, neighbourhoods, fits.
#pragma once

#include <holdfast/pcl/neighborhood_sampler.h>
#include <holdfast/uncertainty/covariance.h>

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace holdfast {

struct ExtractionOptions {
  SamplerOptions sampler;
  /// fit.viewpoint is set from the cloud's sensor pose.
  FitOptions fit;
  CovarianceMode covariance = CovarianceMode::Exact;
  int threads = 0; ///< 0: all cores
  /// Called now and then with (done, total); from one thread at a time.
  std::function<void(int, int)> progress;
};

/// One fitted patch and where it came from.
struct ExtractedPatch {
  FitResult fit;
  /// Index and position of the seed; nothing when all points were fitted at once.
  std::optional<int> seed_index;
  Eigen::Vector3d seed = Eigen::Vector3d::Zero();
  double radius_m = 0.0;
};

struct ExtractionResult {
  std::vector<ExtractedPatch> patches; ///< usable fits, in the order of the seeds
  std::map<FitStatus, int> rejected; ///< how many seeds failed, by reason
  /// Finite points of the cloud left out of all fits: their covariance is indefinite or
  /// not finite, or the noise model has none for them (behind the camera).
  int invalid_covariances = 0;
  /// What the user should know, one line each.
  std::vector<std::string> notices;
};

/// Samples neighbourhoods and fits a patch to each, in parallel over patches; the
/// result does not depend on the number of threads.
///
/// Covariances come from the cloud, else from the sensor. When most points lie where
/// that sensor cannot see (a scan from all sides, a survey), its noise means nothing:
/// 1 mm in every direction is assumed, with a notice.
/// \throw std::invalid_argument on options or clouds that make no sense.
ExtractionResult extractPatches(const RangeCloud& cloud,
                                const Sensor& sensor,
                                const ExtractionOptions& options);

/// One patch fitted to all valid points of the cloud, covariances as above. `rejected`
/// has one entry when it failed.
ExtractionResult extractWhole(const RangeCloud& cloud,
                              const Sensor& sensor,
                              const ExtractionOptions& options);

} // namespace holdfast
