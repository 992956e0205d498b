#include <holdfast/fusion/patch_map.h>

#include "geometry/symmetric.h"
#include <holdfast/fusion/roughness.h>
#include <holdfast/geometry/gaussian.h>

#include <Eigen/Geometry>
#include <Eigen/LU>

#include <boost/math/distributions/chi_squared.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <utility>

namespace holdfast {
namespace {

constexpr int kNone = -1;

// Correlation of two views below which they are independent: exp(-2), two lengths of a
// wave apart.
constexpr double kNextToNothing = 0.135;

// The support's moments forget: of more points than this the older ones count half.
constexpr float kMostPoints = 10'000.0F;

void
requireValid(const std::string& error)
{
  if (!error.empty())
    throw std::invalid_argument("holdfast::PatchMap: " + error);
}

bool
isPose(const Pose& pose)
{
  constexpr double kRounding = 1e-6; // of a rotation that came through a file
  return pose.R.allFinite() && pose.c.allFinite() &&
         (pose.R.transpose() * pose.R).isIdentity(kRounding) &&
         pose.R.determinant() > 0.0;
}

/// Of the error of a pose: what it must be not to be a claim.
std::string
covarianceError(const JetMatrix& S)
{
  constexpr double kRounding = 1e-9;
  if (!S.allFinite())
    return "the covariance of a pose must be finite";
  if (S.isZero(0.0))
    return "the covariance of a pose must not be zero: nobody knows one exactly";
  if (!S.isApprox(S.transpose(), kRounding))
    return "the covariance of a pose must be symmetric";
  if (!isPositiveSemiDefinite(S, kRounding))
    return "the covariance of a pose must be positive semi-definite";
  return "";
}

/// Largest magnitude of a principal curvature of a surface that is nearly level, as far
/// as it is known to be one: less two of its sigmas.
double
strongestCurvature(const JetFilter& filter)
{
  constexpr double kSigmas = 2.0;
  const JetVector& jet = filter.value();
  const double mean = 0.5 * (jet[3] + jet[5]), half = 0.5 * (jet[3] - jet[5]);
  const JetMatrix P = filter.covariance();
  const double sigma = std::sqrt(std::max(P(3, 3), P(5, 5)));
  return std::max(0.0, std::abs(mean) + std::hypot(half, jet[4]) - kSigmas * sigma);
}

Eigen::Vector3d
centreOf(const MapPatch& patch)
{
  return patch.anchor.toWorld({0.0, 0.0, patch.jet.value()[0]});
}

bool
isFit(const Measurement& m)
{
  return m.jet.value.allFinite() && m.jet.white.allFinite() &&
         m.jet.pattern.allFinite() && isPose(m.anchor) && m.radius_m > 0.0 &&
         std::isfinite(m.radius_m) &&
         (m.jet.covariance().diagonal().array() > 0.0).all();
}

/// How far from linear a measurement is in the noise: its normal's uncertainty times
/// the tangent of the angle it is seen under, which is the relative change of its
/// covariance with an error of one sigma; seen straighter than at 35 degrees, that
/// of 35.
double
tiltError(const Measurement& m)
{
  constexpr double kLeastTangent = 0.7;
  const double cosine = std::abs(m.anchor.R.col(2).dot(m.anchor.c)) / m.anchor.c.norm();
  const double tangent = std::sqrt(std::max(0.0, 1.0 - cosine * cosine)) / cosine;
  const JetMatrix P = m.jet.covariance();
  return std::sqrt(P(1, 1) + P(2, 2)) * std::max(tangent, kLeastTangent);
}

/// Adds the moments of a view, given in its own axes, in the plane of the anchor.
void
addMoments(const Measurement& m, const Pose& in_anchor, std::array<float, 6>& sums)
{
  const Eigen::Matrix2d W = in_anchor.R.topLeftCorner<2, 2>();
  Eigen::Matrix2d M;
  M << m.moments[0], m.moments[1], m.moments[1], m.moments[2];
  const Eigen::Vector2d c = in_anchor.c.head<2>();
  const Eigen::Matrix2d S = W * M * W.transpose() + c * c.transpose();
  const double n = m.points;
  const double added[6] =
      {n, n * c.x(), n * c.y(), n * S(0, 0), n * S(0, 1), n * S(1, 1)};
  for (std::size_t i = 0; i < sums.size(); ++i)
    sums[i] += static_cast<float>(added[i]);
  if (sums[0] > kMostPoints)
    for (float& sum : sums)
      sum *= 0.5F;
}

/// Covariance of xx xy yy in the axes of the anchor.
Eigen::Matrix3d
turnedMoments(const Eigen::Matrix3d& S, const Pose& in_anchor)
{
  const Eigen::Matrix3d T =
      symmetric::planeTurn(Eigen::Matrix2d(in_anchor.R.topLeftCorner<2, 2>()));
  return T * S * T.transpose();
}

void
beginEpochOf(const Measurement& m, MapPatch& patch)
{
  const Eigen::Vector3d& p = m.anchor.c;
  patch.epoch_direction = (p.head<2>() / p.z()).cast<float>();
  patch.epoch_depth_m = static_cast<float>(p.z());
  patch.epoch_kept.setOnes();
}

/// Of height, slopes and curvatures, for each number of a jet.
JetVector
byOrder(const Eigen::Vector3d& of)
{
  return (JetVector() << of[0], of[1], of[1], of[2], of[2], of[2]).finished();
}

/// What of the pattern of the epoch's start is left in a view.
Eigen::Vector3d
patternLeft(const Measurement& m, const MapPatch& patch, const PatchMapOptions& options)
{
  const Eigen::Vector3d& p = m.anchor.c;
  const double depth = patch.epoch_depth_m;
  if (std::abs(p.z() - depth) > options.max_depth_change * depth)
    return Eigen::Vector3d::Zero();
  const Eigen::Vector2d direction = p.head<2>() / p.z();
  // A disc is as wide as a Gaussian of half its radius.
  return patternCorrelation(options.pattern,
                            0.5 * m.radius_m / p.z(),
                            (direction - patch.epoch_direction.cast<double>()).norm());
}

void
addView(const Measurement& m, const Pose& anchor, MapPatch& patch)
{
  const Pose in_anchor = patch.anchor.inverse() * anchor;
  addMoments(m, in_anchor, patch.moments);
  const Packed<3> S = Packed<3>::of(turnedMoments(m.moments_covariance, in_anchor));
  std::copy(S.v.begin(), S.v.end(), patch.moments_covariance.begin());
  // A point of the anchor's plane as the measurement's own grid has it.
  const Pose inverse = in_anchor.inverse();
  patch.support.add(m.support,
                    inverse.R.topLeftCorner<2, 2>() * (patch.radius_m / m.radius_m),
                    inverse.c.head<2>() / m.radius_m);
  patch.chi2 += m.chi2;
  patch.chi2_expected += m.chi2_expected;
  patch.chi2_per_roughness += m.design.chi2_per_roughness;
  ++patch.views;
  patch.conflicts = 0;
}

/// Of two patches of one place: its height is less sure; of equals the younger.
bool
isWorse(const MapPatch& patch, const MapPatch& other)
{
  const double a = patch.jet.covariance()(0, 0), b = other.jet.covariance()(0, 0);
  return std::pair(a, patch.id) > std::pair(b, other.id);
}

} // namespace

std::string
validityError(const PatchMapOptions& o)
{
  const auto positive = [](double x) { return x > 0.0 && std::isfinite(x); };
  if (!positive(o.radius_m) || !positive(o.min_radius_m))
    return "radii must be positive";
  if (!positive(o.association_radius) || o.association_radius > 1.0)
    return "the association radius must be in (0, 1]";
  if (!(o.gate_level > 0.0 && o.gate_level < 1.0))
    return "the level of the gate must be in (0, 1)";
  if (!positive(o.max_tilt_rad) || !positive(o.max_normal_angle_rad) ||
      !positive(o.max_uncertainty_rad))
    return "angles must be positive";
  if (!positive(o.s3_floor_per_m2) || !positive(o.s3_limit_per_m2))
    return "third derivatives must be positive";
  if (o.max_views < 1 || o.conflicts_to_replace < 1)
    return "numbers of views and conflicts must be positive";
  for (const PatternReach& wave : o.pattern)
    if (!positive(wave.variance) || !(wave.length >= 0.0) ||
        !std::isfinite(wave.length))
      return "waves of the pattern must have a variance, and no negative length";
  if (!positive(o.max_depth_change))
    return "the change of depth must be positive";
  if (!positive(o.volume_radius_m) || !positive(o.max_height_sigma_m))
    return "the limits of the map must be positive";
  return "";
}

Sight
sightOf(const WantedSeed& seed, double depth_m, double sigma_m)
{
  constexpr double kSigmas = 3.0;
  if (!std::isfinite(depth_m))
    return Sight::Hidden;
  const double reach = kSigmas * std::hypot(seed.depth_sigma_m, sigma_m) +
                       seed.radius_m; // the surface falls away within a patch
  if (depth_m < seed.position.z() - reach)
    return Sight::Hidden;
  return depth_m > seed.position.z() + reach ? Sight::SeenThrough : Sight::Seen;
}

PatchMap::PatchMap(const PatchMapOptions& options) : options_(options)
{
  requireValid(validityError(options));
  gate_ = boost::math::quantile(
      boost::math::complement(boost::math::chi_squared(6.0), options.gate_level));
  smallest_cosine_ = std::cos(options.max_normal_angle_rad);
  rebuild();
  poolRoughness({});
}

PatchMap::PatchMap(Snapshot snapshot) : PatchMap(snapshot.options)
{
  std::uint64_t last = 0;
  for (const MapPatch& patch : snapshot.patches) {
    requireValid(patch.id > last && patch.id < snapshot.next_id ?
                     "" :
                     "the patches of a map must be in the order of their ids");
    requireValid(isPose(patch.anchor) && patch.jet.value().allFinite() &&
                         patch.radius_m > 0.0 ?
                     "" :
                     "a patch of a map is not finite");
    last = patch.id;
  }
  requireValid(isPose(snapshot.pose) && snapshot.frames >= 0 ? "" :
                                                               "the pose is not one");
  pose_ = snapshot.pose;
  frames_ = snapshot.frames;
  next_id_ = snapshot.next_id;
  patches_ = std::move(snapshot.patches);
  rebuild();
  poolRoughness({});
}

PatchMap::Snapshot
PatchMap::snapshot() const
{
  return {options_, pose_, frames_, next_id_, patches_};
}

void
PatchMap::move(const Pose& increment, const JetMatrix& covariance)
{
  requireValid(isPose(increment) ? "" : "an increment must be a finite pose");
  requireValid(covarianceError(covariance));
  const Pose before = pose_;
  pose_ = before * increment;
  // Rounding would grow from step to step: an inverse is taken as the transpose.
  pose_.R = Eigen::Quaterniond(pose_.R).normalized().toRotationMatrix();
  // To the axes of the map: delta is in those of the new sensor frame, c of the old.
  JetMatrix T = JetMatrix::Zero();
  T.topLeftCorner<3, 3>() = pose_.R;
  T.bottomRightCorner<3, 3>() = before.R;
  pose_covariance_.reset();
  const JetMatrix in_map = T * covariance * T.transpose();
  for (MapPatch& patch : patches_)
    patch.jet.inflate(errorOf(in_map, patch.jet.value(), patch.anchor));
}

void
PatchMap::place(const Pose& pose, const JetMatrix& covariance)
{
  requireValid(isPose(pose) ? "" : "a pose must be finite");
  requireValid(covarianceError(covariance));
  pose_ = pose;
  JetMatrix T = JetMatrix::Identity();
  T.topLeftCorner<3, 3>() = pose.R;
  pose_covariance_ = T * covariance * T.transpose();
}

// What an error of the sensor's pose, pivoting about the sensor, does to a jet.
// \param covariance of (omega, t), frame of the map
JetMatrix
PatchMap::errorOf(const JetMatrix& covariance,
                  const JetVector& jet,
                  const Pose& anchor) const
{
  JetMatrix turn = JetMatrix::Zero();
  turn.topLeftCorner<3, 3>() = turn.bottomRightCorner<3, 3>() = anchor.R.transpose();
  const JetMatrix G = jetByMotion(jet, anchor.toLocal(pose_.c)) * turn;
  return G * covariance * G.transpose();
}

std::vector<WantedSeed>
PatchMap::wantedSeeds(const Camera& camera, const Pose& sensor) const
{
  constexpr double kSmallestCosine = 0.17; // 80 degrees: beyond, nothing is measured
  std::vector<WantedSeed> wanted;
  for (const MapPatch& patch : patches_) {
    const Eigen::Vector3d p = sensor.toLocal(centreOf(patch));
    if (!(p.z() > 0.0))
      continue;
    const Eigen::Vector2d pixel = camera.project(p);
    if (!(pixel.x() >= 0.0 && pixel.x() <= camera.width - 1 && pixel.y() >= 0.0 &&
          pixel.y() <= camera.height - 1))
      continue;
    const Eigen::Vector3d n = sensor.R.transpose() * patch.anchor.R.col(2);
    const double cosine = -n.dot(p.normalized());
    if (cosine < kSmallestCosine)
      continue;
    const double height = std::sqrt(patch.jet.covariance()(0, 0));
    wanted.push_back({patch.id, p, pixel, patch.radius_m, height / cosine});
  }
  return wanted;
}

double
PatchMap::reach() const
{
  return options_.association_radius * options_.radius_m;
}

bool
PatchMap::isFacingAs(const MapPatch& patch, const Pose& anchor) const
{
  return patch.anchor.R.col(2).dot(anchor.R.col(2)) > smallest_cosine_;
}

void
PatchMap::listCandidates(const Pose& anchor, std::uint64_t asked_by)
{
  candidates_.clear();
  const double largest = reach();
  visitNear(anchor.c, [&](int i) {
    const MapPatch& patch = patches_[static_cast<std::size_t>(i)];
    const double distance = (patch.anchor.c - anchor.c).norm();
    if (distance < largest && isFacingAs(patch, anchor))
      candidates_.push_back({i, patch.id == asked_by ? -1.0 : distance});
  });
  // The one that asked first, then by distance; of equals the older.
  std::sort(candidates_.begin(),
            candidates_.end(),
            [](const Candidate& a, const Candidate& b) {
              return std::pair(a.distance, a.index) < std::pair(b.distance, b.index);
            });
}

const MapPatch*
PatchMap::find(std::uint64_t id) const
{
  const auto at = std::lower_bound(
      patches_.begin(),
      patches_.end(),
      id,
      [](const MapPatch& patch, std::uint64_t x) { return patch.id < x; });
  return at != patches_.end() && at->id == id ? &*at : nullptr;
}

const MapPatch*
PatchMap::nearest(const Measurement& measurement,
                  const Pose& sensor,
                  double reach_m) const
{
  const Pose anchor = sensor * measurement.anchor;
  const MapPatch* best = nullptr;
  double least = reach_m > 0.0 ? reach_m : reach();
  visitWithin(anchor.c, least, [&](int i) {
    const MapPatch& patch = patches_[static_cast<std::size_t>(i)];
    const double distance = (patch.anchor.c - anchor.c).norm();
    if (distance < least && isFacingAs(patch, anchor)) {
      least = distance;
      best = &patch;
    }
  });
  return best;
}

bool
PatchMap::hasAnchorWithin(const Eigen::Vector3d& place, double distance_m) const
{
  bool is_there = false;
  visitNear(place, [&](int i) {
    is_there |=
        (patches_[static_cast<std::size_t>(i)].anchor.c - place).norm() < distance_m;
  });
  return is_there;
}

bool
PatchMap::covers(const MapPatch& patch, const Eigen::Vector3d& place) const
{
  const Eigen::Vector3d p = patch.anchor.toLocal(place);
  const JetVector& jet = patch.jet.value();
  const double x = p.x(), y = p.y();
  const double height = jet[0] + jet[1] * x + jet[2] * y +
                        0.5 * (jet[3] * x * x + 2.0 * jet[4] * x * y + jet[5] * y * y);
  return std::abs(p.z() - height) < reach() &&
         patch.support.contains(x / patch.radius_m, y / patch.radius_m);
}

bool
PatchMap::isCovered(const Eigen::Vector3d& place) const
{
  bool is_covered = false;
  visitWithin(place, SupportGrid::kReach * options_.radius_m, [&](int i) {
    is_covered |= covers(patches_[static_cast<std::size_t>(i)], place);
  });
  return is_covered;
}

UpdateReport
PatchMap::update(const std::vector<Measurement>& measurements,
                 const std::vector<std::uint64_t>& seen_through)
{
  ++frames_;
  first_of_frame_ = next_id_;
  UpdateReport report;
  order_.resize(measurements.size());
  std::iota(order_.begin(), order_.end(), 0);
  const auto at = [&](int i) -> const Measurement& {
    return measurements[static_cast<std::size_t>(i)];
  };
  std::sort(order_.begin(), order_.end(), [&](int a, int b) {
    return at(a).id < at(b).id;
  });
  for (std::size_t i = 1; i < order_.size(); ++i)
    requireValid(at(order_[i - 1]).id < at(order_[i]).id ?
                     "" :
                     "measurements of a frame must have different ids");
  poolRoughness(measurements);
  for (const int i : order_)
    take(at(i), report);
  for (const std::uint64_t id : seen_through)
    if (const MapPatch* patch = find(id); patch && patch->taken_in != frames_) {
      ++report.seen_through;
      conflict(patches_[static_cast<std::size_t>(patch - patches_.data())],
               nullptr,
               report);
    }
  split(report);
  merge(report);
  forget(report);
  poolRoughness({});
  return report;
}

void
PatchMap::poolRoughness(const std::vector<Measurement>& measurements)
{
  double excess = 0.0, weight = 0.0;
  for (const MapPatch& patch : patches_) {
    excess += patch.chi2 - patch.chi2_expected;
    weight += patch.chi2_per_roughness;
  }
  // In the order of their ids, as everything.
  for (std::size_t i = 0; i < measurements.size(); ++i) {
    const Measurement& m = measurements[static_cast<std::size_t>(order_[i])];
    if (!isFit(m))
      continue;
    excess += m.chi2 - m.chi2_expected;
    weight += m.design.chi2_per_roughness;
  }
  const double floor = options_.s3_floor_per_m2 * options_.s3_floor_per_m2;
  squared_roughness_ = weight > 0.0 ? std::max(floor, excess / weight) : floor;
}

void
PatchMap::take(const Measurement& m, UpdateReport& report)
{
  if (!isFit(m)) {
    ++report.unfit;
    return;
  }
  if (tiltError(m) > options_.max_uncertainty_rad) {
    ++report.uncertain;
    return;
  }
  const Pose anchor = pose_ * m.anchor;
  listCandidates(anchor, m.asked_by);
  MapPatch* refused = nullptr;
  bool is_near = false;
  for (const Candidate& candidate : candidates_) {
    MapPatch& patch = patches_[static_cast<std::size_t>(candidate.index)];
    const double distance = (patch.anchor.c - anchor.c).norm();
    if (strongestCurvature(patch.jet) * distance > options_.max_tilt_rad)
      continue;
    is_near = true;
    if (patch.taken_in == frames_)
      continue;
    if (patch.restarts || fuse(m, anchor, patch)) {
      if (patch.restarts)
        restart(m, anchor, patch.radius_m, patch);
      patch.taken_in = patch.last_seen = frames_;
      ++report.fused;
      return;
    }
    if (!refused)
      refused = &patch;
  }
  if (refused)
    conflict(*refused, &m, report);
  else if (is_near || isOnFormer(anchor))
    ++report.surplus;
  else {
    bear(m, anchor);
    ++report.born;
  }
}

// Supports of the same frame lie as dense as was asked for; further ones between those
// of former frames would be born as long as a sensor looks, since noise moves the
// centre of what is seen.
bool
PatchMap::isOnFormer(const Pose& anchor) const
{
  bool is_on = false;
  visitWithin(anchor.c, SupportGrid::kReach * options_.radius_m, [&](int i) {
    const MapPatch& patch = patches_[static_cast<std::size_t>(i)];
    is_on |= patch.id < first_of_frame_ && isFacingAs(patch, anchor) &&
             covers(patch, anchor.c);
  });
  return is_on;
}

bool
PatchMap::fuse(const Measurement& m, const Pose& anchor, MapPatch& patch) const
{
  const ThirdToJet by_third =
      movedThirdToJet(m.design.by_third, patch.anchor.inverse() * anchor);
  const auto jet = transported(m.jet, anchor, patch.anchor, by_third);
  if (!jet)
    return false;
  JetMatrix white = jet->white;
  if (pose_covariance_)
    white += errorOf(*pose_covariance_, jet->value, patch.anchor);
  // What was lost on the way does not come back. Of the view before, more is left than
  // of the epoch's start, also where another epoch begins.
  const Eigen::Vector3d before = patch.epoch_kept.cast<double>();
  const Eigen::Vector3d kept =
      jet->pattern.isZero(0.0) ?
          Eigen::Vector3d::Zero() :
          Eigen::Vector3d(patternLeft(m, patch, options_).cwiseMin(before));
  const bool is_new_epoch = kept[0] < kNextToNothing;
  JetFilter filter = patch.jet;
  filter.changePattern(byOrder(kept.cwiseQuotient(before.cwiseMax(1e-9))),
                       jet->pattern);
  if (is_new_epoch && patch.epochs >= options_.max_views)
    filter.fade(1.0 + 1.0 / options_.max_views);
  const ThirdToJet off = by_third - thirdToJetOfDisc(patch.radius_m);
  if (!filter.update(jet->value, white, gate_, off))
    return false;
  patch.jet = filter;
  if (is_new_epoch) {
    ++patch.epochs;
    beginEpochOf(m, patch);
  }
  else {
    patch.epoch_kept = kept.cast<float>();
  }
  addView(m, anchor, patch);
  patch.jet.setRoughness(roughnessOf(patch));
  return true;
}

void
PatchMap::restart(const Measurement& m,
                  const Pose& anchor,
                  double radius_m,
                  MapPatch& patch) const
{
  const std::uint64_t id = patch.id;
  patch = MapPatch();
  patch.id = id;
  patch.anchor = anchor;
  patch.radius_m = radius_m;
  addView(m, anchor, patch); // which tells how rough it is
  Jet jet = m.jet;
  if (pose_covariance_)
    jet.white += errorOf(*pose_covariance_, jet.value, anchor);
  patch.jet = JetFilter(jet,
                        m.design.by_third - thirdToJetOfDisc(radius_m),
                        roughnessOf(patch));
  beginEpochOf(m, patch);
  patch.epochs = 1;
  patch.taken_in = patch.last_seen = frames_;
}

void
PatchMap::bear(const Measurement& m, const Pose& anchor)
{
  patches_.emplace_back();
  patches_.back().id = next_id_++;
  restart(m, anchor, options_.radius_m, patches_.back());
  insert(static_cast<int>(patches_.size()) - 1);
}

// A patch that something speaks against; what was measured there, if anything, takes
// its place when that has happened too often.
void
PatchMap::conflict(MapPatch& patch, const Measurement* m, UpdateReport& report)
{
  patch.taken_in = frames_;
  if (++patch.conflicts < options_.conflicts_to_replace) {
    report.gated += m ? 1 : 0;
    return;
  }
  if (!m) {
    patch.radius_m = 0.0;
    ++report.forgotten;
    return;
  }
  patch.radius_m = 0.0;
  bear(*m, pose_ * m->anchor);
  ++report.replaced;
}

void
PatchMap::split(UpdateReport& report)
{
  constexpr double kMisfit = 2.0; // chi2 over its expectation
  for (MapPatch& patch : patches_)
    if (patch.last_seen == frames_ && patch.chi2 > kMisfit * patch.chi2_expected &&
        roughnessOf(patch) > options_.s3_limit_per_m2 &&
        0.5 * patch.radius_m >= options_.min_radius_m && !patch.restarts) {
      patch.radius_m *= 0.5;
      patch.restarts = true;
      ++report.split;
    }
}

void
PatchMap::merge(UpdateReport& report)
{
  is_dropped_.assign(patches_.size(), 0);
  const double nearest = 0.5 * reach();
  for (std::size_t i = 0; i < patches_.size(); ++i) {
    const MapPatch& patch = patches_[i];
    if (patch.last_seen != frames_ || patch.radius_m == 0.0 || is_dropped_[i])
      continue;
    visitNear(patch.anchor.c, [&](int j) {
      const auto k = static_cast<std::size_t>(j);
      const MapPatch& other = patches_[k];
      const double distance = (patch.anchor.c - other.anchor.c).norm();
      if (k == i || is_dropped_[i] || is_dropped_[k] || other.radius_m == 0.0 ||
          distance >= nearest || other.radius_m != patch.radius_m ||
          strongestCurvature(patch.jet) * distance > options_.max_tilt_rad)
        return;
      const Jet jet{other.jet.value(), other.jet.covariance(), JetMatrix::Zero()};
      const ThirdToJet by_third =
          movedThirdToJet(thirdToJetOfDisc(other.radius_m),
                          patch.anchor.inverse() * other.anchor);
      const auto moved = transported(jet, other.anchor, patch.anchor, by_third);
      // Both rest on points they share: never are they fused.
      if (moved && patch.jet.distance(moved->value, moved->white) <= gate_)
        is_dropped_[isWorse(patch, other) ? i : k] = 1;
    });
  }
  for (std::size_t i = 0; i < patches_.size(); ++i)
    if (is_dropped_[i]) {
      patches_[i].radius_m = 0.0;
      ++report.merged;
    }
}

void
PatchMap::forget(UpdateReport& report)
{
  const double most = options_.max_height_sigma_m * options_.max_height_sigma_m;
  const auto isLost = [&](const MapPatch& patch) {
    if (patch.radius_m == 0.0)
      return true; // given up, and counted as that
    const bool lost =
        !((patch.anchor.c - pose_.c).norm() <= options_.volume_radius_m) ||
        !(patch.jet.covariance()(0, 0) <= most);
    report.forgotten += lost ? 1 : 0;
    return lost;
  };
  const auto end = std::remove_if(patches_.begin(), patches_.end(), isLost);
  if (end == patches_.end())
    return;
  patches_.erase(end, patches_.end());
  rebuild();
}

// Cells of the map's frame, in buckets: any two places nearer than a cell are in
// adjacent ones.
std::size_t
PatchMap::bucketOf(const Eigen::Vector3d& place, int dx, int dy, int dz) const
{
  const double cell = options_.radius_m; // no reach is longer
  std::uint64_t hash = 0;
  const int offset[3] = {dx, dy, dz};
  for (int axis = 0; axis < 3; ++axis) {
    const auto i =
        static_cast<std::int64_t>(std::floor(place[axis] / cell)) + offset[axis];
    hash = (hash ^ static_cast<std::uint64_t>(i)) * 0x9E3779B97F4A7C15ULL;
    hash ^= hash >> 29;
  }
  return hash & (first_.size() - 1);
}

void
PatchMap::insert(int index)
{
  const auto i = static_cast<std::size_t>(index);
  if (patches_.size() > first_.size()) {
    rebuild();
    return;
  }
  int& first = first_[bucketOf(patches_[i].anchor.c, 0, 0, 0)];
  next_.resize(patches_.size());
  next_[i] = first;
  first = index;
}

void
PatchMap::rebuild()
{
  constexpr std::size_t kFewest = 1024;
  std::size_t buckets = std::max(kFewest, first_.size());
  while (buckets < 2 * patches_.size())
    buckets *= 2;
  first_.assign(buckets, kNone);
  next_.assign(patches_.size(), kNone);
  for (std::size_t i = 0; i < patches_.size(); ++i) {
    int& first = first_[bucketOf(patches_[i].anchor.c, 0, 0, 0)];
    next_[i] = first;
    first = static_cast<int>(i);
  }
}

template <typename Visit>
void
PatchMap::visitNear(const Eigen::Vector3d& place, Visit&& visit) const
{
  // Two cells may share a bucket, whose patches are visited once all the same.
  std::array<std::size_t, 27> buckets;
  int count = 0;
  for (int dx = -1; dx <= 1; ++dx)
    for (int dy = -1; dy <= 1; ++dy)
      for (int dz = -1; dz <= 1; ++dz) {
        const std::size_t bucket = bucketOf(place, dx, dy, dz);
        const auto end = buckets.begin() + count;
        if (std::find(buckets.begin(), end, bucket) == end)
          buckets[static_cast<std::size_t>(count++)] = bucket;
      }
  for (int b = 0; b < count; ++b)
    for (int i = first_[buckets[static_cast<std::size_t>(b)]]; i != kNone;
         i = next_[static_cast<std::size_t>(i)])
      if (patches_[static_cast<std::size_t>(i)].radius_m > 0.0)
        visit(i);
}

// Any distance; where cells share a bucket, its patches are visited again.
template <typename Visit>
void
PatchMap::visitWithin(const Eigen::Vector3d& place,
                      double distance_m,
                      Visit&& visit) const
{
  if (distance_m <= options_.radius_m) {
    visitNear(place, visit);
    return;
  }
  const int n = static_cast<int>(std::ceil(distance_m / options_.radius_m));
  for (int dx = -n; dx <= n; ++dx)
    for (int dy = -n; dy <= n; ++dy)
      for (int dz = -n; dz <= n; ++dz)
        for (int i = first_[bucketOf(place, dx, dy, dz)]; i != kNone;
             i = next_[static_cast<std::size_t>(i)])
          if (patches_[static_cast<std::size_t>(i)].radius_m > 0.0)
            visit(i);
}

} // namespace holdfast
