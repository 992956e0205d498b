#include <holdfast/fusion/registration.h>

#include <holdfast/fusion/roughness.h>
#include <holdfast/geometry/constants.h>
#include <holdfast/geometry/gaussian.h>
#include <holdfast/geometry/rotation.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
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
  JetMatrix own; ///< covariance of the residual without the pattern
  JetMatrix information; ///< of the residual
  JetMatrix by_pose; ///< of the prediction, by (delta, c) of the sensor
  /// What errors of its slopes alone seem to tell of (delta, c), for an information of
  /// one on its height.
  JetMatrix noise;
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
slopeNoise(const Eigen::Matrix2d& slopes, const JetMatrix& chain)
{
  const Eigen::Matrix<double, 2, 6> in_plane = chain.middleRows<2>(3);
  return in_plane.transpose() * slopes * in_plane;
}

/// What a pair tells when others around have the same error. Of n alike, each with the
/// covariance S, the information of all is that of one, n (n S)^-1, as if S were n
/// times as large. Of the pattern as many share it as its waves reach; of all else
/// those that rest on the same points, as the map's patches do when the frame's do.
/// \param overlap how many patches have a point of this one, itself included.
JetMatrix
sharedInformation(const Pair& pair, double overlap)
{
  JetMatrix S = overlap * pair.own;
  if (pair.sharers) {
    const JetVector root = pair.sharers->cwiseSqrt();
    S += root.asDiagonal() * pair.measurement->jet.pattern * root.asDiagonal();
  }
  return S.llt().solve(JetMatrix(JetMatrix::Identity()));
}

/// Share of a disc of radius a that another of radius b at a distance covers.
double
sharedDisc(double distance, double a, double b)
{
  if (distance >= a + b)
    return 0.0;
  const double smaller = std::min(a, b);
  if (distance <= std::abs(a - b))
    return smaller * smaller / (a * a);
  // Two segments, each a sector less its triangle.
  const auto segment = [](double r, double height) {
    const double angle = std::acos(std::clamp(height / r, -1.0, 1.0));
    return r * r * angle - height * std::sqrt(std::max(0.0, r * r - height * height));
  };
  const double to_chord = (distance * distance + a * a - b * b) / (2.0 * distance);
  return (segment(a, to_chord) + segment(b, distance - to_chord)) / (kPi * a * a);
}

/// Of how many of the pairs a point of each is, on average.
std::vector<double>
overlapsAmong(const std::vector<Pair>& pairs)
{
  std::vector<std::size_t> order(pairs.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const auto centre = [&](std::size_t i) -> const Eigen::Vector3d& {
    return pairs[i].measurement->anchor.c;
  };
  const auto radius = [&](std::size_t i) { return pairs[i].measurement->radius_m; };
  std::sort(order.begin(), order.end(), [&](std::size_t i, std::size_t j) {
    return std::pair(centre(i).x(), i) < std::pair(centre(j).x(), j);
  });
  double largest = 0.0;
  for (const std::size_t i : order)
    largest = std::max(largest, radius(i));
  std::vector<double> overlaps(pairs.size(), 1.0);
  for (std::size_t a = 0; a < order.size(); ++a)
    for (std::size_t b = a + 1; b < order.size(); ++b) {
      const std::size_t i = order[a], j = order[b];
      if (centre(j).x() - centre(i).x() >= 2.0 * largest)
        break;
      const double distance = (centre(i) - centre(j)).norm();
      overlaps[i] += sharedDisc(distance, radius(i), radius(j));
      overlaps[j] += sharedDisc(distance, radius(j), radius(i));
    }
  return overlaps;
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
  directions.reserve(measurements.size());
  for (const Measurement& m : measurements)
    directions.push_back(direction(m));
  constexpr int kSteps = 64; // of a table: there are a million pairs in a frame
  std::vector<JetVector> sharers;
  sharers.reserve(measurements.size());
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
  Pair pair{match, m.jet.value - moved->value, {}, {}, {}, {}, 0.0};
  const JetMatrix Q = modelError(m.design.by_third, by_third, map.roughnessOf(patch));
  const JetMatrix& F = moved->by_jet;
  pair.own = m.jet.white + F * patch.jet.covariance() * F.transpose() + Q;
  const Eigen::LLT<JetMatrix> factor(JetMatrix(pair.own + m.jet.pattern));
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
  pair.noise = slopeNoise(likely.slopes, chain);
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
  matches.reserve(measurements.size());
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
  pairs.reserve(matches.size());
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
  /// \param information of the pair, as far as it counts
  void add(const Pair& pair, const JetMatrix& information)
  {
    const JetMatrix weighted = information * pair.by_pose;
    information_ += weighted.transpose() * pair.by_pose;
    noise_ += information(0, 0) * pair.noise;
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

  /// True where a share of the step has led to a place with less to go, in these sigmas
  /// (the natural test of monotonicity).
  bool leadsTo(const NormalEquations& next, double share) const
  {
    const JetVector left = covariance_ * next.gradient_;
    constexpr double kLeast = 0.25; // of what a linear problem would leave less
    return std::sqrt(left.dot(information_ * left)) <=
           (1.0 - kLeast * share) * stepInSigmas();
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
  static constexpr int kFreeSteps = 6; ///< of the gated ones, whose pairs may change

  /// A step, and from where.
  struct Taken {
    Pose pose;
    NormalEquations equations;
  };

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
    reach_ = std::max(last_reach_, 0.5 * reach_);
    if (is_robust) {
      result_.pose = moved(result_.pose, equations.step());
      return;
    }
    // The whole step: what is damped says nothing of how far the way still is.
    if (equations.stepInSigmas() <= options_.step_tolerance_sigma) {
      result_.pose = moved(result_.pose, equations.step());
      result_.status = RegistrationStatus::Converged;
      return;
    }
    goOn(equations);
  }

  /// Curvatures without their noise are smaller than the true ones, so that steps may
  /// be more than twice too long, and then never end. While pairs come and go a step
  /// that goes back is halved; once they stay, one is refused that does not lead nearer
  /// to where there is none to take. That, and not chi2: these derivatives are not its.
  void goOn(const NormalEquations& equations)
  {
    if (last_ && isSettled() && !last_->equations.leadsTo(equations, damping_)) {
      damping_ *= 0.5;
      result_.pose = moved(last_->pose, damping_ * last_->equations.step());
      return;
    }
    constexpr double kLeast = 0.25;
    if (!isSettled() && last_ && equations.isAgainst(last_->equations.step()))
      damping_ = std::max(kLeast, 0.5 * damping_);
    // The first of the settled ones has no other with the same pairs to compare with.
    last_ = Taken{result_.pose, equations};
    result_.pose = moved(result_.pose, damping_ * equations.step());
  }

  bool isSettled() const
  {
    return gated_steps_ > kFreeSteps + 1;
  }

  /// Where the pose may be far off: patches of further around, none of them trusted.
  NormalEquations robustEquations()
  {
    return equationsOf(pairsAround(reach_), options_.robust_distance);
  }

  /// Where it is near: as the map itself associates. Pairs that come and go at the gate
  /// may keep steps going for ever; after some, those of the last one stay.
  NormalEquations gatedEquations()
  {
    std::vector<Pair> pairs;
    if (++gated_steps_ <= kFreeSteps) {
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
    return equationsOf(pairs, std::numeric_limits<double>::infinity());
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

  NormalEquations equationsOf(const std::vector<Pair>& pairs, double robust_distance)
  {
    const std::vector<double> overlaps = overlapsAmong(pairs);
    NormalEquations equations;
    result_.pairs = static_cast<int>(pairs.size());
    result_.chi2 = 0.0;
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      equations.add(pairs[i],
                    robustWeight(pairs[i].distance, robust_distance) *
                        sharedInformation(pairs[i], overlaps[i]));
      result_.chi2 += pairs[i].distance;
    }
    if (result_.pairs >= options_.min_pairs)
      equations.solve(lever_, options_.smallest_information);
    return equations;
  }

  const std::vector<Measurement> measurements_;
  std::vector<JetVector> sharers_; ///< of each; empty where there is no pattern
  const PatchMap& map_;
  const RegistrationOptions& options_;
  double lever_, last_reach_, reach_;
  int gated_steps_ = 0;
  double damping_ = 1.0;
  std::optional<Taken> last_;
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
  near.reserve(measurements.size());
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
