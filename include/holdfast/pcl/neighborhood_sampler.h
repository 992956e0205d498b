/// \file Seeds and the points around them.
#pragma once

#include <holdfast/patch/patch.h>
#include <holdfast/pcl/range_cloud.h>
#include <holdfast/sensor/sensor.h>

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace holdfast {

enum class Neighborhood : std::uint8_t {
  /// Points whose rays meet the surface around the seed within the radius, measured
  /// along the surface, so that a patch is as large as asked for at every tilt; in
  /// organized clouds connected to the seed. Unbiased, since what the noise does to a
  /// point along its ray does not decide. Clouds without a known viewpoint: Ball.
  Patch,
  /// Organized clouds: pixels within the image of the metric radius, connected to the
  /// seed, cut at depth discontinuities. Unbiased: a metric ball cuts the noise tails.
  Disc,
  Ball, ///< points within the radius
  /// Points whose shortest path from the seed is within the radius; paths run over the
  /// pixel grid, not across depth discontinuities (unorganized: from each point to its
  /// eight nearest). Noise makes paths longer: where sigma_z is above the pixel pitch
  /// the neighbourhood shrinks.
  Geodesic,
  Knn ///< the k nearest points
};

enum class SeedStrategy : std::uint8_t {
  /// One spacing apart along the surface, near and far alike (organized), or in a voxel
  /// grid.
  Grid,
  Random, ///< uniform over the valid points
  Poisson ///< random, but no two closer than the spacing in metres
};

struct SamplerOptions {
  Neighborhood neighborhood = Neighborhood::Patch;
  double radius_m = 0.05;
  int k = 100; ///< points of a Knn neighbourhood
  SeedStrategy strategy = SeedStrategy::Grid;
  int max_seeds = 0; ///< 0: as many as the spacing gives (Random: as many as on a Grid)
  double spacing_m = 0.05; ///< between seeds
  /// Stop when there are so many patches, when they cover this much surface, or after
  /// this time; 0: never (sampling_budget.h). Where the number alone is limited, all
  /// seeds are tried and the best patches taken, a spacing apart if there are enough;
  /// streams (FrameExtractor) take what comes first.
  int max_patches = 0;
  double max_area_m2 = 0.0;
  double max_time_s = 0.0;
  std::uint64_t random_seed = 1;
  /// Neighbouring pixels belong together when their depths differ by less than
  /// max(jump_sigmas * sigma_z, max_slope * lateral distance).
  double jump_sigmas = 4.0;
  double max_slope = 4.0;
};

/// The same without limits of patches, area and time.
SamplerOptions withoutLimits(SamplerOptions options);

/// Empty when the options make sense, else one sentence naming the first that does not.
std::string validityError(const SamplerOptions& options);

/// Finds seeds and neighbourhoods in organized and unorganized clouds.
///
/// A cloud counts as organized when its points lie on the pixels of a pinhole camera
/// (recovered from the points, see intrinsics.h, or the sensor's); only points in front
/// of that camera are valid then. Disc falls back to Ball where the cloud is not
/// organized. Same result for any number of threads: all randomness is in seeds(), and
/// neighborhood() is const with caller-owned scratch.
class NeighborhoodSampler {
public:
  /// Working memory of one thread.
  struct Scratch;
  struct ScratchDeleter {
    void operator()(Scratch* scratch) const;
  };
  using ScratchPtr = std::unique_ptr<Scratch, ScratchDeleter>;

  /// Refers to the cloud, which must outlive the sampler. Sorts the points of an
  /// unorganized cloud into cubes, which takes about its memory again, and builds a k-d
  /// tree, of as much, only for Knn, and Geodesic in unorganized clouds.
  /// \throw std::invalid_argument when an option or the cloud makes no sense.
  NeighborhoodSampler(const RangeCloud& cloud,
                      const Sensor& sensor,
                      const SamplerOptions& options);
  ~NeighborhoodSampler();

  /// Indices of valid points: ascending on a Grid, in the order drawn otherwise. A Grid
  /// with more than max_seeds is made coarser, so that it still spans the cloud; when
  /// sampling may stop early it is shuffled, for the same reason.
  std::vector<int> seeds() const;

  const SamplerOptions& options() const;

  /// The cloud counts as organized.
  bool usesPixels() const;

  ScratchPtr makeScratch() const;

  /// Indices of the valid points around point `seed`, ascending, the seed among them;
  /// none when the seed itself is invalid.
  /// \throw std::invalid_argument when there is no such point.
  void neighborhood(int seed, Scratch& scratch, std::vector<int>& indices) const;

  /// What is left of the neighbourhood where it turned out to be of two surfaces: the
  /// points on the one that the inner half of the radius shows. Of a Patch; others are
  /// the same again.
  void strictNeighborhood(int seed, Scratch& scratch, std::vector<int>& indices) const;

  /// Of the pixels that see a bounded patch in the frame of the cloud, and have a valid
  /// point, the share whose point is further from it, along the ray, than four sigmas:
  /// in front of it, or behind it where it reaches over an edge. Some 100 pixels are
  /// asked. 0 for clouds that are not organized.
  /// \param seed of the patch, whose noise counts.
  double strayShare(int seed, const Patch& patch) const;

private:
  struct Impl;
  std::unique_ptr<const Impl> impl_;
};

} // namespace holdfast
