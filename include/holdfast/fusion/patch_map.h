/// \file Patches over time: a map of jets around a moving sensor.
///
///     PatchMap map(options);
///     for each frame:
///       map.move(increment, covariance);       // not where the sensor stood still
///       seeds = map.wantedSeeds(camera);       // fit there, and where none is
///       report = map.update(measurements);     // measurementOf(fit, points)
///
/// What is common to a frame does not average: the map is robot-centric. Anchors lie
/// fixed in a frame of the map, the sensor moves through it by the increments it is
/// given, and what these may be off by is added to every patch, so that the covariance
/// of a patch is that of where it lies from the sensor now. It is not that of where it
/// lies in the world; of differences between two patches it leaves out what they share.
#pragma once

#include <holdfast/fit/options.h>
#include <holdfast/fit/result.h>
#include <holdfast/fusion/jet_filter.h>
#include <holdfast/fusion/measurement.h>
#include <holdfast/fusion/pattern_reach.h>
#include <holdfast/sensor/camera.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace holdfast {

struct PatchMapOptions {
  /// Of the discs whose best quadric the patches are, m: what is to be fitted.
  double radius_m = 0.05;
  /// A measurement belongs to a patch whose anchor is no further from its centre, in
  /// radii, and whose normal is within max_normal_angle_rad of its own.
  double association_radius = 0.5;
  double max_normal_angle_rad = 0.5236;
  /// Probability that the gate refuses a measurement that belongs to its patch.
  double gate_level = 0.01;
  /// A measurement whose centre is this far around the bend of a patch (largest
  /// curvature times distance) gets a patch of its own: the paraboloid about one axis
  /// is none about the other.
  double max_tilt_rad = 0.1;
  /// A measurement whose normal is uncertain by more than this over the tangent of the
  /// angle it is seen under (at least 35 degrees) tells too little to be fused: the
  /// covariance that comes with it follows its own error, and what errs to the one side
  /// would count more than what errs to the other (`experiment map`: NEES/dof by sigma
  /// of the slope). Half of it maps less of what is far, so that patches have fewer
  /// views and poses fewer pairs.
  double max_uncertainty_rad = 0.1;
  /// Root mean square third derivative that every surface is granted, 1/m^2, and how
  /// large it may become before a misfit (chi2 over twice its expectation) makes a
  /// patch of half the radius.
  double s3_floor_per_m2 = 10.0;
  double s3_limit_per_m2 = 100.0;
  double min_radius_m = 0.02;
  /// Independent views after which further ones replace what is known and add nothing:
  /// what of the model is wrong does not average.
  int max_views = 16;
  /// Refusals of the gate in a row after which a patch is what was measured last.
  int conflicts_to_replace = 3;
  /// How far the errors that pixels share reach over the view (patternReach()). What of
  /// them is left when a spot has moved over it is the same error; once that is next to
  /// nothing, the view is independent. Measurements without a pattern are independent
  /// always.
  std::vector<PatternReach> pattern = singleWave(0.05);
  /// Share of the depth by which that must change for the pattern to be another one.
  /// What a camera's pixels have as their own stays at any depth; where the rest is
  /// known to change with it, a smaller share lets more views count (FUSION 3: 0.05).
  double max_depth_change = 1.0;
  /// Patches further from the sensor are forgotten, and those whose height is no longer
  /// known to max_height_sigma_m.
  double volume_radius_m = 10.0;
  double max_height_sigma_m = 0.05;
};

/// Empty when the options make sense, else one sentence naming the first that does not.
std::string validityError(const PatchMapOptions& options);

/// One patch of the map. Less than 1 KiB with what the map keeps beside it.
struct MapPatch {
  std::uint64_t id = 0; ///< never given again
  Pose anchor; ///< frame of the map; exact by definition
  JetFilter jet; ///< of the best quadric over the disc of radius_m, at the anchor
  double radius_m = 0.0;
  /// Of all points seen, in the anchor's plane: n, Sx, Sy, Sxx, Sxy, Syy (m, m^2); all
  /// are halved when n gets large, so that they follow what is seen.
  std::array<float, 6> moments{};
  /// Upper triangle of the covariance of a single view's second moments, m^4: they are
  /// sums over points that are chosen alike each time, and do not average.
  std::array<float, 6> moments_covariance{};
  SupportGrid support; ///< in radii of radius_m
  double chi2 = 0.0, chi2_expected = 0.0, chi2_per_roughness = 0.0; ///< sums
  Eigen::Vector2f epoch_direction = Eigen::Vector2f::Zero(); ///< x/z, y/z at its start
  float epoch_depth_m = 0.0F;
  /// Correlation of the pattern with that at its start: height, slopes, curvatures.
  Eigen::Vector3f epoch_kept = Eigen::Vector3f::Ones();
  int views = 0;
  int epochs = 0; ///< independent views
  int conflicts = 0; ///< in a row
  int last_seen = 0; ///< number of the update
  int taken_in = 0; ///< the same, also of a refused measurement
  bool restarts = false; ///< the next measurement replaces it: its radius has changed
};

/// A place where the map wants to be measured.
struct WantedSeed {
  std::uint64_t patch = 0;
  Eigen::Vector3d position = Eigen::Vector3d::Zero(); ///< frame of the sensor, m
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
  double radius_m = 0.0;
  double depth_sigma_m = 0.0; ///< of position.z() along the ray, as the map knows it
};

/// What a depth measured at the pixel of a wanted seed says of it.
enum class Sight : std::uint8_t {
  Seen,
  Hidden, ///< something is in front of it
  SeenThrough ///< the ray goes through: it is not there
};

/// \param depth_m measured there, NaN: nothing, which counts as hidden.
/// \param sigma_m of that measurement.
Sight sightOf(const WantedSeed& seed, double depth_m, double sigma_m);

/// What an update did. Every measurement is in one of the first seven.
struct UpdateReport {
  int fused = 0;
  int born = 0; ///< no patch was near
  int gated = 0; ///< refused by the gate of the patch near it
  int replaced = 0; ///< refused once too often: the patch is what was measured
  /// The patch near it had its measurement in this frame, or it lies on the support of
  /// one from a former frame (PatchMap::isCovered()).
  int surplus = 0;
  int uncertain = 0; ///< PatchMapOptions::max_uncertainty_rad
  int unfit = 0; ///< not finite, or with a covariance that is none
  int seen_through = 0; ///< patches that were, of those named
  int merged = 0; ///< patches given up for a better one at the same place
  int split = 0; ///< patches that misfit, now of half the radius
  int forgotten = 0; ///< patches out of the volume, or of which too little is known
};

class PatchMap {
public:
  /// \throw std::invalid_argument when the options make no sense.
  explicit PatchMap(const PatchMapOptions& options = {});

  const PatchMapOptions& options() const
  {
    return options_;
  }

  /// Squared Mahalanobis distance at which the gate closes: chi-square of six numbers.
  double gate() const
  {
    return gate_;
  }

  /// The sensor moved: `increment` is its new pose in its old frame.
  /// \param covariance of (delta, c), R <- R Exp(delta), c in the axes of the old
  ///        frame, rad and m.
  /// \throw std::invalid_argument when a pose is none, or the covariance is zero, not
  /// symmetric or not positive semi-definite: a motion known exactly is a claim that
  /// nobody can make. A sensor that stood still does not move.
  void move(const Pose& increment, const JetMatrix& covariance);

  /// The sensor is at a pose of the map's frame that something else than the last pose
  /// has told (motion capture, markers), with an error that no other frame shares: it
  /// is that of the measurements of the next update, whereas move() adds to the map's.
  /// \param covariance as move()
  void place(const Pose& pose, const JetMatrix& covariance);

  /// Of the sensor, frame of the map, which is that of the sensor at first.
  const Pose& pose() const
  {
    return pose_;
  }

  /// Patches that a camera has before it, and that face it. What hides them is not
  /// known here: sightOf().
  /// \param sensor pose in the frame of the map.
  std::vector<WantedSeed> wantedSeeds(const Camera& camera, const Pose& sensor) const;

  std::vector<WantedSeed> wantedSeeds(const Camera& camera) const
  {
    return wantedSeeds(camera, pose_);
  }

  /// Takes the measurements of one frame; ids must differ. The result does not depend
  /// on their order. One measurement feeds at most one patch, and one patch takes at
  /// most one, since neighbours share points.
  /// \param seen_through patches through which the sensor saw: a conflict each.
  UpdateReport update(const std::vector<Measurement>& measurements,
                      const std::vector<std::uint64_t>& seen_through = {});

  /// In the order of their ids.
  const std::vector<MapPatch>& patches() const
  {
    return patches_;
  }

  const MapPatch* find(std::uint64_t id) const;

  /// The patch nearest to a measurement of the sensor at a pose that may be the same
  /// piece of surface; null: there is none.
  /// \param reach_m how far its anchor may be; 0: as far as the map associates.
  const MapPatch* nearest(const Measurement& measurement,
                          const Pose& sensor,
                          double reach_m = 0.0) const;

  /// Root mean square third derivative of a patch, 1/m^2, as the misfits of all its
  /// views tell it, as far as they do: of a single view that is next to nothing, and
  /// what is taken is that of the whole map.
  double roughnessOf(const MapPatch& patch) const
  {
    const double w = patch.chi2_per_roughness;
    double squared = squared_roughness_;
    if (w > 0.0) {
      // Patches differ as much as their mean; chi-square scatters by twice its own.
      const double prior = squared * squared;
      const double scatter = 2.0 * std::max(patch.chi2_expected, 1.0) / (w * w);
      const double gain = prior / (prior + scatter);
      squared += gain * ((patch.chi2 - patch.chi2_expected) / w - squared);
    }
    return std::max(options_.s3_floor_per_m2, std::sqrt(std::max(squared, 0.0)));
  }

  /// True where a patch's anchor is nearer to a place of the map's frame than this, m;
  /// at most options().radius_m.
  bool hasAnchorWithin(const Eigen::Vector3d& place, double distance_m) const;

  /// True where a place of the map's frame lies on what a patch was seen of, no further
  /// from its surface than the map associates: a patch there would rest on its points.
  bool isCovered(const Eigen::Vector3d& place) const;

  /// How many updates there were.
  int frames() const
  {
    return frames_;
  }

  /// A map as it was: everything that counts.
  struct Snapshot {
    PatchMapOptions options;
    Pose pose;
    int frames = 0;
    std::uint64_t next_id = 1;
    std::vector<MapPatch> patches;
  };
  Snapshot snapshot() const;

  /// \throw std::invalid_argument when the snapshot makes no sense.
  explicit PatchMap(Snapshot snapshot);

private:
  struct Candidate {
    int index;
    double distance;
  };

  void take(const Measurement& measurement, UpdateReport& report);
  void listCandidates(const Pose& anchor, std::uint64_t asked_by);
  bool fuse(const Measurement& measurement, const Pose& anchor, MapPatch& patch) const;
  void bear(const Measurement& measurement, const Pose& anchor);
  void conflict(MapPatch& patch, const Measurement* measurement, UpdateReport& report);
  void restart(const Measurement& measurement,
               const Pose& anchor,
               double radius_m,
               MapPatch& patch) const;
  void split(UpdateReport& report);
  void merge(UpdateReport& report);
  void forget(UpdateReport& report);
  bool covers(const MapPatch& patch, const Eigen::Vector3d& place) const;
  bool isOnFormer(const Pose& anchor) const;
  bool isFacingAs(const MapPatch& patch, const Pose& anchor) const;
  double reach() const;
  JetMatrix errorOf(const JetMatrix& covariance,
                    const JetVector& jet,
                    const Pose& anchor) const;

  std::size_t bucketOf(const Eigen::Vector3d& place, int dx, int dy, int dz) const;
  void insert(int index);
  void rebuild();
  template <typename Visit>
  void visitNear(const Eigen::Vector3d& place, Visit&& visit) const;
  template <typename Visit>
  void visitWithin(const Eigen::Vector3d& place,
                   double distance_m,
                   Visit&& visit) const;
  void poolRoughness(const std::vector<Measurement>& measurements);

  PatchMapOptions options_;
  double gate_ = 0.0;
  double smallest_cosine_ = 0.0; ///< of normals that belong together
  double squared_roughness_ = 0.0; ///< of the whole map
  Pose pose_;
  std::optional<JetMatrix> pose_covariance_; ///< of place(); none: robot-centric
  int frames_ = 0;
  std::uint64_t next_id_ = 1;
  std::uint64_t first_of_frame_ = 1; ///< of the ids given in the last update
  std::vector<MapPatch> patches_;
  // Patches by cells of the map, in chains: the first of each bucket, the next of each
  // patch.
  std::vector<int> first_, next_;
  std::vector<Candidate> candidates_; ///< working memory, as the next two
  std::vector<int> order_;
  std::vector<char> is_dropped_;
};

/// The patch as one of the fits knows them, frame of the map: type by the tests of
/// stage I-3 on the fused curvatures, bounds from the moments of its support. The
/// centre is the surface's point on the anchor's axis, so that its covariance is along
/// that axis alone. chi2 is the sum over all views.
/// \param options what is a plane and how much of the support bounds enclose; `surface`
///        is Auto or Paraboloid.
/// \throw std::invalid_argument for other requests.
FitResult toFitResult(const MapPatch& patch, const FitOptions& options = {});

} // namespace holdfast
