#include <holdfast/fusion/registration.h>

#include <holdfast/fusion/roughness.h>
#include <holdfast/geometry/gaussian.h>
#include <holdfast/geometry/rotation.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

namespace holdfast {
namespace {

/// A measurement and the patch it is taken for.
struct Match {
  const Measurement* measurement;
  const MapPatch* patch;
  /// Of how many patches around the pattern's errors are the same, itself included: of
  /// each number of the jet. Null where there is no pattern.
  const JetVector* sharers;
};

/// What the map says of a measurement at a pose of the sensor.
struct Pair : Match {
  JetVector residual; ///< measured less predicted, at the measurement's own anchor
  JetMatrix information; ///< of the residual
  JetMatrix by_pose; ///< of the prediction, by (delta, c) of the sensor
  JetMatrix noise; ///< information on (delta, c) that errors of its slopes seem to be
  double distance; ///< squared, of the residual in its sigmas
};

constexpr double kCurvatures = 3.0; // numbers of a jet

/// Of the curvatures, squared, in sigmas.
double
curvatureInSigmas(const JetVector& jet, const JetMatrix& covariance)
{
  const Eigen::Vector3d k = jet.tail<3>();
  return k.dot(covariance.bottomRightCorner<3, 3>().llt().solve(k));
}

/// How far the curvatures of all patches together are more than noise: what their
/// squares have beyond their expectation and two sigmas of it. Of flat ground nothing.
double
curvedShare(const std::vector<Match>& matches)
{
  constexpr double kSigmas = 2.0;
  double sum = 0.0;
  for (const Match& match : matches)
    sum += curvatureInSigmas(match.patch->jet.value(), match.patch->jet.covariance());
  const double expected = kCurvatures * static_cast<double>(matches.size());
  const double noise = expected + kSigmas * std::sqrt(2.0 * expected);
  return sum > noise ? 1.0 - noise / sum : 0.0;
}

/// The jet with curvatures as far as they are more than noise (James and Stein's
/// estimate). What a jet tells of the pose is by its shape, and noise in the curvatures
/// of a plane would seem to hold it in x and y.
/// \param share of the curvatures that all patches together leave.
JetVector
withoutNoise(JetVector jet, const JetMatrix& covariance, double share)
{
  jet.tail<3>() *=
      share * std::max(0.0, 1.0 - kCurvatures / curvatureInSigmas(jet, covariance));
  return jet;
}

struct LikelyShape {
  JetVector jet;
  Eigen::Matrix2d slopes; ///< their covariance
};

/// The jet that the map and the measurement make together, without noise. The map's
/// alone would pull the pose to where anchors coincide: its errors are both in the
/// residual and in how the pose moves that, and their product does not average. That of
/// the most likely jet with the residual does (total least squares).
/// \param F d prediction / d jet of the map
LikelyShape
likelyShape(const JetFilter& filter,
            const Pair& pair,
            const JetMatrix& F,
            double curved_share,
            double gate)
{
  JetMatrix P = filter.covariance();
  JetVector jet = filter.value();
  if (pair.distance <= gate) { // else they are not of one place
    const JetMatrix gain = P * F.transpose() * pair.information;
    jet += gain * pair.residual;
    P = symmetrized(P - gain * F * P);
  }
  return {withoutNoise(jet, P, curved_share), P.block<2, 2>(1, 1)};
}

/// What errors of slopes alone seem to tell of the pose: a step t within the plane of a
/// patch moves its height by -g t, and so it does where g is nothing but noise.
JetMatrix
slopeNoise(const Pair& pair, const Eigen::Matrix2d& slopes, const JetMatrix& chain)
{
  const Eigen::Matrix<double, 2, 6> in_plane = chain.middleRows<2>(3);
  return pair.information(0, 0) * in_plane.transpose() * slopes * in_plane;
}

/// What a pair tells when others around have the same error. Of n alike, each with the
/// pattern P and S beside it, the information of all is n (S + n P)^-1, as if the
/// pattern of each were n times as large. What the map knows counts as its own.
JetMatrix
sharedInformation(const Jet& jet, const JetMatrix& predicted, const JetVector& sharers)
{
  const JetVector root = sharers.cwiseSqrt();
  const JetMatrix S =
      jet.white + predicted + root.asDiagonal() * jet.pattern * root.asDiagonal();
  return S.llt().solve(JetMatrix(JetMatrix::Identity()));
}

/// How many of a frame's measurements have the same error of the pattern as each.
std::vector<JetVector>
sharersAmong(const std::vector<Measurement>& measurements,
             const std::vector<PatternReach>& waves)
{
  const auto direction = [](const Measurement& m) -> Eigen::Vector2d {
    return m.anchor.c.head<2>() / m.anchor.c.z();
  };
  double longest = 0.0;
  for (const PatternReach& wave : waves)
    longest = std::max(longest, wave.length);
  std::vector<Eigen::Vector2d> directions;
  for (const Measurement& m : measurements)
    directions.push_back(direction(m));
  constexpr int kSteps = 64; // of a table: there are a million pairs in a frame
  std::vector<JetVector> sharers;
  for (const Measurement& m : measurements) {
    // A disc is as wide as a Gaussian of half its radius.
    const double support = 0.5 * m.radius_m / m.anchor.c.z();
    constexpr double kReach = 3.0; // of the correlation, exp(-4.5) there
    const double step =
        kReach * std::hypot(longest, std::sqrt(2.0) * support) / (kSteps - 1);
    std::array<Eigen::Vector3d, kSteps> correlation;
    for (int i = 0; i < kSteps; ++i)
      correlation[static_cast<std::size_t>(i)] =
          patternCorrelation(waves, support, i * step);
    const Eigen::Vector2d here = direction(m);
    Eigen::Vector3d sum = Eigen::Vector3d::Zero(); // with itself
    for (const Eigen::Vector2d& there : directions) {
      const auto i = static_cast<std::size_t>((there - here).norm() / step + 0.5);
      if (i < correlation.size())
        sum += correlation[i];
    }
    JetVector& numbers = sharers.emplace_back();
    numbers << sum[0], sum[1], sum[1], sum[2], sum[2], sum[2];
    numbers = numbers.cwiseMax(1.0);
  }
  return sharers;
}

/// FUSION 5: with the relative pose of the measurement's anchor in the patch's,
/// d(phi, t) = [Rb^T 0; -Ra^T R [c]x Ra^T] d(delta, c) of the sensor.
std::optional<Pair>
pairAt(const Match& match, const PatchMap& map, const Pose& sensor, double curved_share)
{
  const Measurement& m = *match.measurement;
  const MapPatch& patch = *match.patch;
  const Pose relative = patch.anchor.inverse() * (sensor * m.anchor);
  const ThirdToJet by_third =
      movedThirdToJet(thirdToJetOfDisc(patch.radius_m), relative.inverse());
  const auto moved = movedJet(patch.jet.value(), relative, by_third);
  if (!moved)
    return std::nullopt;
  Pair pair{match, m.jet.value - moved->value, {}, {}, {}, 0.0};
  const JetMatrix Q = modelError(m.design.by_third, by_third, map.roughnessOf(patch));
  const JetMatrix& F = moved->by_jet;
  const JetMatrix predicted = F * patch.jet.covariance() * F.transpose();
  const Eigen::LLT<JetMatrix> factor(JetMatrix(m.jet.covariance() + predicted + Q));
  if (factor.info() != Eigen::Success)
    return std::nullopt;
  pair.information = factor.solve(JetMatrix(JetMatrix::Identity()));
  pair.distance = pair.residual.dot(pair.information * pair.residual);
  const LikelyShape likely = likelyShape(patch.jet, pair, F, curved_share, map.gate());
  const auto shape = movedJet(likely.jet, relative, by_third);
  if (!shape)
    return std::nullopt;
  const Eigen::Matrix3d to_patch = patch.anchor.R.transpose();
  JetMatrix chain = JetMatrix::Zero();
  chain.topLeftCorner<3, 3>() = m.anchor.R.transpose();
  chain.bottomLeftCorner<3, 3>() = -to_patch * sensor.R * skew(m.anchor.c);
  chain.bottomRightCorner<3, 3>() = to_patch;
  pair.by_pose = shape->by_pose * chain;
  if (match.sharers)
    pair.information =
        sharedInformation(m.jet, JetMatrix(predicted + Q), *match.sharers);
  pair.noise = slopeNoise(pair, likely.slopes, chain);
  if (!pair.by_pose.allFinite() || !std::isfinite(pair.distance))
    return std::nullopt;
  return pair;
}

/// Measurements with the patch of the map each may belong to at a pose.
std::vector<Match>
matchesAt(const std::vector<Measurement>& measurements,
          const std::vector<JetVector>& sharers,
          const PatchMap& map,
          const Pose& sensor,
          double reach_m)
{
  std::vector<Match> matches;
  for (std::size_t i = 0; i < measurements.size(); ++i)
    if (const MapPatch* patch = map.nearest(measurements[i], sensor, reach_m))
      matches.push_back(
          {&measurements[i], patch, sharers.empty() ? nullptr : &sharers[i]});
  return matches;
}

std::vector<Pair>
pairsOf(const std::vector<Match>& matches, const PatchMap& map, const Pose& sensor)
{
  const double share = curvedShare(matches);
  std::vector<Pair> pairs;
  for (const Match& match : matches)
    if (const auto pair = pairAt(match, map, sensor, share))
      pairs.push_back(*pair);
  return pairs;
}

/// Where several want the same patch, the one that fits best has it.
void
useEachPatchOnce(std::vector<Pair>& pairs)
{
  std::sort(pairs.begin(), pairs.end(), [](const Pair& a, const Pair& b) {
    if (a.patch->id != b.patch->id)
      return a.patch->id < b.patch->id;
    return std::pair(a.distance, a.measurement->id) <
           std::pair(b.distance, b.measurement->id);
  });
  pairs.erase(std::unique(pairs.begin(),
                          pairs.end(),
                          [](const Pair& a, const Pair& b) {
                            return a.patch->id == b.patch->id;
                          }),
              pairs.end());
}

/// Sums over pairs, and the step that they ask for.
class NormalEquations {
public:
  void add(const Pair& pair, double weight)
  {
    const JetMatrix weighted = weight * pair.information * pair.by_pose;
    information_ += weighted.transpose() * pair.by_pose;
    noise_ += weight * pair.noise;
    gradient_ += weighted.transpose() * pair.residual;
  }

  /// \param length_m of a rotation's lever arm, which makes rad and m comparable
  void solve(double length_m, double smallest_share)
  {
    constexpr double kNoises = 3.0; // so many times as much is no noise
    JetVector scale = JetVector::Ones();
    scale.head<3>() /= length_m;
    const JetMatrix scaled = scale.asDiagonal() * information_ * scale.asDiagonal();
    const Eigen::SelfAdjointEigenSolver<JetMatrix> solver(scaled);
    const JetVector& values = solver.eigenvalues(); // ascending
    const JetMatrix noise = scale.asDiagonal() * noise_ * scale.asDiagonal();
    const auto isTold = [&](int i) {
      const JetVector v = solver.eigenvectors().col(i);
      return values[i] >
             std::max(smallest_share * values[5], kNoises * v.dot(noise * v));
    };
    lost_ = 0;
    while (lost_ < 6 && !isTold(lost_))
      ++lost_;
    const Directions all = scale.asDiagonal() * solver.eigenvectors();
    null_space_ = all.leftCols(lost_).colwise().normalized();
    const Directions seen = all.rightCols(6 - lost_);
    const Eigen::MatrixXd inverse =
        (seen.transpose() * information_ * seen)
            .llt()
            .solve(Eigen::MatrixXd::Identity(6 - lost_, 6 - lost_));
    covariance_ = seen * inverse * seen.transpose();
    step_ = covariance_ * gradient_;
  }

  const JetVector& step() const
  {
    return step_;
  }
  const JetMatrix& covariance() const
  {
    return covariance_;
  }
  const Eigen::Matrix<double, 6, Eigen::Dynamic, 0, 6, 6>& nullSpace() const
  {
    return null_space_;
  }

  /// True where the step goes back some of another one's way.
  bool isAgainst(const JetVector& other) const
  {
    return step_.dot(information_ * other) < 0.0;
  }

  /// Length of the step in sigmas.
  double stepInSigmas() const
  {
    return std::sqrt(step_.dot(information_ * step_));
  }

private:
  using Directions = Eigen::Matrix<double, 6, Eigen::Dynamic, 0, 6, 6>;

  JetMatrix information_ = JetMatrix::Zero();
  JetMatrix noise_ = JetMatrix::Zero(); ///< information that there is none
  JetVector gradient_ = JetVector::Zero();
  JetVector step_ = JetVector::Zero();
  JetMatrix covariance_ = JetMatrix::Zero();
  Directions null_space_{6, 0};
  int lost_ = 0;
};

Pose
moved(const Pose& pose, const JetVector& step)
{
  return {pose.R * expMap(step.head<3>()), pose.c + step.tail<3>()};
}

/// Root mean square distance of the measurements from the sensor.
double
leverOf(const std::vector<Measurement>& measurements)
{
  double squared = 0.0;
  for (const Measurement& m : measurements)
    squared += m.anchor.c.squaredNorm();
  return std::sqrt(squared / static_cast<double>(measurements.size()));
}

bool
hasPattern(const std::vector<Measurement>& measurements)
{
  return std::any_of(measurements.begin(),
                     measurements.end(),
                     [](const Measurement& m) { return !m.jet.pattern.isZero(0.0); });
}

/// Huber: what is far pulls as strongly as what is at the limit.
double
robustWeight(double squared_distance, double limit)
{
  const double distance = std::sqrt(squared_distance);
  return distance <= limit ? 1.0 : limit / distance;
}

/// The way to the pose.
class Registration {
public:
  /// \param measurements at least one; they have a patch near.
  Registration(std::vector<Measurement> measurements,
               const PatchMap& map,
               const Pose& guess,
               const RegistrationOptions& options)
  : measurements_(std::move(measurements))
  , map_(map)
  , options_(options)
  , lever_(leverOf(measurements_))
  , last_reach_(map.options().association_radius * map.options().radius_m)
  , reach_(options.first_reach * map.options().radius_m)
  {
    result_.pose = guess;
    result_.status = RegistrationStatus::IterationLimit;
    if (hasPattern(measurements_))
      sharers_ = sharersAmong(measurements_, map.options().pattern);
  }

  RegistrationResult run()
  {
    const Pose guess = result_.pose;
    while (result_.status == RegistrationStatus::IterationLimit &&
           result_.iterations < options_.max_iterations)
      step();
    if (result_.status == RegistrationStatus::TooFewPairs ||
        result_.status == RegistrationStatus::NotObservable) {
      result_.pose = guess;
      result_.covariance.setZero();
    }
    return result_;
  }

private:
  /// One of Gauss and Newton.
  void step()
  {
    ++result_.iterations;
    const bool is_robust = reach_ > last_reach_;
    const NormalEquations equations = is_robust ? robustEquations() : gatedEquations();
    if (result_.pairs < options_.min_pairs) {
      result_.status = RegistrationStatus::TooFewPairs;
      return;
    }
    result_.null_space = equations.nullSpace();
    result_.covariance = equations.covariance();
    if (result_.null_space.cols() == 6) {
      result_.status = RegistrationStatus::NotObservable;
      return;
    }
    if (!is_robust)
      damp(equations);
    result_.pose = moved(result_.pose, damping_ * equations.step());
    if (!is_robust &&
        damping_ * equations.stepInSigmas() <= options_.step_tolerance_sigma)
      result_.status = RegistrationStatus::Converged;
    reach_ = std::max(last_reach_, 0.5 * reach_);
  }

  /// Curvatures without their noise are smaller than the true ones, so that steps may
  /// be more than twice too long, and then never end.
  void damp(const NormalEquations& equations)
  {
    constexpr double kLeast = 0.25;
    if (equations.isAgainst(last_step_))
      damping_ = std::max(kLeast, 0.5 * damping_);
    last_step_ = equations.step();
  }

  /// Where the pose may be far off: patches of further around, none of them trusted.
  NormalEquations robustEquations()
  {
    const std::vector<Pair> pairs = pairsAround(reach_);
    NormalEquations equations;
    for (const Pair& pair : pairs)
      equations.add(pair, robustWeight(pair.distance, options_.robust_distance));
    finish(pairs, equations);
    return equations;
  }

  /// Where it is near: as the map itself associates. Pairs that come and go at the gate
  /// may keep steps going for ever; after some, those of the last one stay.
  NormalEquations gatedEquations()
  {
    constexpr int kFree = 6;
    std::vector<Pair> pairs;
    if (++gated_steps_ <= kFree) {
      pairs = pairsAround(last_reach_);
      const auto passes = [&](const Pair& pair) {
        return pair.distance <= map_.gate();
      };
      const auto end = std::stable_partition(pairs.begin(), pairs.end(), passes);
      result_.gated = static_cast<int>(pairs.end() - end);
      pairs.erase(end, pairs.end());
      kept_.assign(pairs.begin(), pairs.end());
    }
    else {
      pairs = pairsOf(kept_, map_, result_.pose);
    }
    NormalEquations equations;
    for (const Pair& pair : pairs)
      equations.add(pair, 1.0);
    finish(pairs, equations);
    return equations;
  }

  std::vector<Pair> pairsAround(double reach_m) const
  {
    std::vector<Pair> pairs =
        pairsOf(matchesAt(measurements_, sharers_, map_, result_.pose, reach_m),
                map_,
                result_.pose);
    useEachPatchOnce(pairs);
    return pairs;
  }

  void finish(const std::vector<Pair>& pairs, NormalEquations& equations)
  {
    result_.pairs = static_cast<int>(pairs.size());
    if (result_.pairs >= options_.min_pairs)
      equations.solve(lever_, options_.smallest_information);
    result_.chi2 = 0.0;
    for (const Pair& pair : pairs)
      result_.chi2 += pair.distance;
  }

  const std::vector<Measurement> measurements_;
  std::vector<JetVector> sharers_; ///< of each; empty where there is no pattern
  const PatchMap& map_;
  const RegistrationOptions& options_;
  double lever_, last_reach_, reach_;
  int gated_steps_ = 0;
  double damping_ = 1.0;
  JetVector last_step_ = JetVector::Zero();
  std::vector<Match> kept_;
  RegistrationResult result_;
};

} // namespace

RegistrationResult
registerPatches(const std::vector<Measurement>& measurements,
                const PatchMap& map,
                const Pose& guess,
                const RegistrationOptions& options)
{
  // Others could only come in after leaps farther than the guess may be off.
  const double reach = options.first_reach * map.options().radius_m;
  std::vector<Measurement> near;
  for (const Measurement& m : measurements)
    if (map.nearest(m, guess, reach))
      near.push_back(m);
  RegistrationResult result;
  result.pose = guess;
  if (!near.empty())
    result = Registration(std::move(near), map, guess, options).run();
  result.unmatched =
      static_cast<int>(measurements.size()) - result.pairs - result.gated;
  return result;
}

} // namespace holdfast
