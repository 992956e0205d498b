/// \file The road from a cloud to patches: covariances, neighbourhoods, fits, checks.
#pragma once

#include <holdfast/patch_estimator.h>
#include <holdfast/pcl/neighborhood_sampler.h>
#include <holdfast/pcl/point_accounting.h>
#include <holdfast/progress.h>
#include <holdfast/validation/checks.h>

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace holdfast {

/// Which side of a surface its normal is on.
enum class NormalSide : std::uint8_t {
  Viewpoint, ///< the side of the sensor
  Outward, ///< away from the middle of the cloud: closed models seen from all sides
  Up ///< towards +z of the cloud: ground that was surveyed from above
};

struct ExtractionOptions {
  SamplerOptions sampler;
  FitOptions fit; ///< its viewpoint is set from the sensor pose and normal_side
  CovarianceMode covariance = CovarianceMode::Exact;
  /// Limits that turn patches down, by default what is no patch of that radius; with
  /// nothing here patches are not even measured.
  std::optional<ValidationOptions> validation = ValidationOptions();
  /// Patches of which better ones have more than this share of the points are left out;
  /// 1: none are. Better means more of it covered by points, a chi-square nearer to
  /// what it should be, a surer normal; so it does where a number of patches is wanted.
  double max_overlap = 1.0;
  NormalSide normal_side = NormalSide::Viewpoint;
  /// Failed attempts stay among the patches, so that there is one for every seed that
  /// had its turn; isAccepted() tells them apart.
  bool keep_failures = false;
  /// Patches that validation turned down stay among them, with their verdict.
  bool keep_turned_down = false;
  int threads = 0; ///< 0: all cores
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
  /// The neighbourhood turned out to be of more than one surface, and what is left of
  /// it was fitted (NeighborhoodSampler::strictNeighborhood()).
  bool is_second_attempt = false;
};

/// True when the fit came out and validation, if asked for, did not turn it down.
bool isAccepted(const ExtractedPatch& patch);

/// The accepted ones among attempts, in their order.
std::vector<ExtractedPatch> acceptedAmong(std::vector<ExtractedPatch> attempts);

struct ExtractionResult {
  /// Accepted ones (see keep_failures), in the order of the seeds, in the frame of the
  /// cloud's points.
  std::vector<ExtractedPatch> patches;
  /// How many seeds gave no patch, by reason, and how many patches validation turned
  /// down.
  std::map<FitStatus, int> rejected;
  std::map<PatchVerdict, int> turned_down;
  int second_attempts = 0; ///< patches that came of one
  PointAccounting points; ///< what became of the points of the cloud
  Sensor sensor; ///< whose noise was used, unless the cloud brought its covariances
  /// False when nobody said where the cloud was taken from and the points do not look
  /// as if it were the assumed place: normals may be on the wrong side.
  bool viewpoint_is_credible = true;
  /// What the user should know, one line each.
  std::vector<std::string> notices;
};

/// A place where a patch is wanted.
struct Seed {
  int index = 0; ///< in the cloud the seeds were chosen from
  Eigen::Vector3d position = Eigen::Vector3d::Zero(); ///< frame of the cloud, m
};

/// Finds the points around a seed: indices into the cloud that is fitted. Called from
/// several threads at once; `thread` (below their number) tells them apart.
using NeighborhoodSearch =
    std::function<void(const Seed& seed, int thread, std::vector<int>& indices)>;

/// Looks at an accepted patch and its points as the fit left them; `attempt` is its
/// place in the order of the seeds. Called from several threads at once.
using PatchObserver = std::function<
    void(std::size_t attempt, const ExtractedPatch& patch, const PointBatch& points)>;

/// Where patches are wanted, and which points belong to them. What is left out is found
/// by a NeighborhoodSampler, as the options say.
struct PatchSites {
  std::optional<std::vector<Seed>> seeds;
  NeighborhoodSearch search; ///< goes with seeds
  /// A stricter search, tried where validation turned down a patch; may be none.
  NeighborhoodSearch second_search;
  /// Without `seeds`: these come first, and of those that the sampler finds the ones
  /// that `is_free` says yes to, if there is such a function.
  std::vector<Seed> first_seeds = {};
  std::function<bool(const Seed&)> is_free = {};
  PatchObserver observe = {}; ///< may be none
};

/// The points of the cloud as seeds.
std::vector<Seed> seedsAt(const RangeCloud& cloud, const std::vector<int>& indices);

/// Fits a patch around every seed, up to the sampler's limits of patches, area or time,
/// in parallel; the result does not depend on the number of threads (save where a time
/// limit ends it).
///
/// Covariances come from the cloud, else from the sensor. When most points lie where
/// that sensor cannot see (a scan from all sides, a survey, other axes or units), its
/// noise means nothing: 1 mm in every direction is assumed, with a notice. Where of
/// several hundred seeds none finds neighbours, the others are not tried, with a notice
/// that says why.
/// \throw std::invalid_argument on options or clouds that make no sense. The sensor
/// needs a noise model only where the cloud has no covariances.
ExtractionResult extractPatches(const RangeCloud& cloud,
                                const Sensor& sensor,
                                const ExtractionOptions& options,
                                const PatchSites& sites = {});

/// One patch fitted to all valid points of the cloud. `rejected` has one entry when it
/// failed. \throw as extractPatches().
ExtractionResult extractWhole(const RangeCloud& cloud,
                              const Sensor& sensor,
                              const ExtractionOptions& options);

} // namespace holdfast
