#include <holdfast/fusion/registration.h>

#include <holdfast/fusion/roughness.h>
#include <holdfast/geometry/rotation.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>
#include <optional>

namespace holdfast {
namespace {

/// A measurement and what the map says of it at a pose of the sensor.
struct Pair {
  const Measurement* measurement;
  const MapPatch* patch;
  JetVector residual; ///< measured less predicted, at the measurement's own anchor
  JetMatrix information; ///< of the residual
  JetMatrix by_pose; ///< of the prediction, by (delta, c) of the sensor
  double distance; ///< squared, of the residual in its sigmas
};

/// The jet with curvatures as far as they are more than noise (James and Stein's
/// estimate). What a jet tells of the pose is by its shape, and noise in the curvatures
/// of a plane would seem to hold it in x and y.
JetVector
withoutNoise(const JetFilter& filter)
{
  JetVector jet = filter.value();
  const Eigen::Matrix3d C = filter.covariance().bottomRightCorner<3, 3>();
  const Eigen::Vector3d k = jet.tail<3>();
  constexpr double kDegrees = 3.0;
  const double squared = k.dot(C.llt().solve(k));
  jet.tail<3>() *= std::max(0.0, 1.0 - kDegrees / squared);
  return jet;
}

/// FUSION 5: with the relative pose of the measurement's anchor in the patch's,
/// d(phi, t) = [Rb^T 0; -Ra^T R [c]x Ra^T] d(delta, c) of the sensor.
std::optional<Pair>
pairAt(const Measurement& m,
       const MapPatch& patch,
       const PatchMap& map,
       const Pose& sensor)
{
  const Pose relative = patch.anchor.inverse() * (sensor * m.anchor);
  const ThirdToJet by_third =
      movedThirdToJet(thirdToJetOfDisc(patch.radius_m), relative.inverse());
  const auto moved = movedJet(patch.jet.value(), relative, by_third);
  const auto shape = movedJet(withoutNoise(patch.jet), relative, by_third);
  if (!moved || !shape)
    return std::nullopt;
  Pair pair{&m, &patch, m.jet.value - moved->value, {}, {}, 0.0};
  const JetMatrix Q = modelError(m.design.by_third, by_third, map.roughnessOf(patch));
  const JetMatrix& F = moved->by_jet;
  const JetMatrix predicted = F * patch.jet.covariance() * F.transpose();
  const Eigen::LLT<JetMatrix> factor(JetMatrix(m.jet.covariance() + predicted + Q));
  if (factor.info() != Eigen::Success)
    return std::nullopt;
  pair.information = factor.solve(JetMatrix(JetMatrix::Identity()));
  pair.distance = pair.residual.dot(pair.information * pair.residual);
  const Eigen::Matrix3d to_patch = patch.anchor.R.transpose();
  JetMatrix chain = JetMatrix::Zero();
  chain.topLeftCorner<3, 3>() = m.anchor.R.transpose();
  chain.bottomLeftCorner<3, 3>() = -to_patch * sensor.R * skew(m.anchor.c);
  chain.bottomRightCorner<3, 3>() = to_patch;
  pair.by_pose = shape->by_pose * chain;
  if (!pair.by_pose.allFinite() || !std::isfinite(pair.distance))
    return std::nullopt;
  return pair;
}

/// Measurements with the patch of the map each belongs to at a pose; where several want
/// the same, the one that fits best has it.
std::vector<Pair>
pairsAt(const std::vector<Measurement>& measurements,
        const PatchMap& map,
        const Pose& sensor,
        double reach_m,
        int& unmatched)
{
  std::vector<Pair> pairs;
  unmatched = 0;
  for (const Measurement& m : measurements) {
    const MapPatch* patch = map.nearest(m, sensor, reach_m);
    const auto pair = patch ? pairAt(m, *patch, map, sensor) : std::nullopt;
    if (pair)
      pairs.push_back(*pair);
    else
      ++unmatched;
  }
  std::sort(pairs.begin(), pairs.end(), [](const Pair& a, const Pair& b) {
    if (a.patch->id != b.patch->id)
      return a.patch->id < b.patch->id;
    return std::pair(a.distance, a.measurement->id) <
           std::pair(b.distance, b.measurement->id);
  });
  const auto end =
      std::unique(pairs.begin(), pairs.end(), [](const Pair& a, const Pair& b) {
        return a.patch->id == b.patch->id;
      });
  unmatched += static_cast<int>(pairs.end() - end);
  pairs.erase(end, pairs.end());
  return pairs;
}

/// Sums over pairs, and the step that they ask for.
class NormalEquations {
public:
  void add(const Pair& pair, double weight)
  {
    const JetMatrix weighted = weight * pair.information * pair.by_pose;
    information_ += weighted.transpose() * pair.by_pose;
    gradient_ += weighted.transpose() * pair.residual;
  }

  /// \param length_m of a rotation's lever arm, which makes rad and m comparable
  void solve(double length_m, double smallest_share)
  {
    JetVector scale = JetVector::Ones();
    scale.head<3>() /= length_m;
    const JetMatrix scaled = scale.asDiagonal() * information_ * scale.asDiagonal();
    const Eigen::SelfAdjointEigenSolver<JetMatrix> solver(scaled);
    const JetVector& values = solver.eigenvalues(); // ascending
    lost_ = 0;
    while (lost_ < 6 && !(values[lost_] > smallest_share * values[5]))
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

  /// Length of the step in sigmas.
  double stepInSigmas() const
  {
    return std::sqrt(step_.dot(information_ * step_));
  }

private:
  using Directions = Eigen::Matrix<double, 6, Eigen::Dynamic, 0, 6, 6>;

  JetMatrix information_ = JetMatrix::Zero();
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

/// Huber: what is far pulls as strongly as what is at the limit.
double
robustWeight(double squared_distance, double limit)
{
  const double distance = std::sqrt(squared_distance);
  return distance <= limit ? 1.0 : limit / distance;
}

/// One Gauss-Newton step from result.pose.
NormalEquations
equationsAt(const std::vector<Measurement>& measurements,
            const PatchMap& map,
            double reach_m,
            std::optional<double> robust_distance,
            RegistrationResult& result)
{
  NormalEquations equations;
  result.pairs = result.gated = 0;
  result.chi2 = 0.0;
  for (const Pair& pair :
       pairsAt(measurements, map, result.pose, reach_m, result.unmatched)) {
    if (!robust_distance && pair.distance > map.gate()) {
      ++result.gated;
      continue;
    }
    ++result.pairs;
    result.chi2 += pair.distance;
    equations.add(pair,
                  robust_distance ? robustWeight(pair.distance, *robust_distance) :
                                    1.0);
  }
  return equations;
}

} // namespace

RegistrationResult
registerPatches(const std::vector<Measurement>& measurements,
                const PatchMap& map,
                const Pose& guess,
                const RegistrationOptions& options)
{
  RegistrationResult result;
  result.pose = guess;
  result.unmatched = static_cast<int>(measurements.size());
  if (measurements.empty())
    return result;
  const double lever = leverOf(measurements);
  const auto givenUp = [&](RegistrationStatus status) {
    result.pose = guess;
    result.covariance.setZero();
    result.status = status;
    return result;
  };
  const double last_reach = map.options().association_radius * map.options().radius_m;
  double reach = 2.0 * options.first_reach * map.options().radius_m;
  while (result.iterations < options.max_iterations) {
    ++result.iterations;
    const bool is_robust = reach > last_reach;
    reach = std::max(last_reach, 0.5 * reach);
    NormalEquations equations =
        equationsAt(measurements,
                    map,
                    reach,
                    is_robust ? std::optional(options.robust_distance) : std::nullopt,
                    result);
    if (result.pairs < options.min_pairs)
      return givenUp(RegistrationStatus::TooFewPairs);
    equations.solve(lever, options.smallest_information);
    result.null_space = equations.nullSpace();
    result.covariance = equations.covariance();
    if (result.null_space.cols() == 6)
      return givenUp(RegistrationStatus::NotObservable);
    result.pose = moved(result.pose, equations.step());
    if (!is_robust && equations.stepInSigmas() <= options.step_tolerance_sigma) {
      result.status = RegistrationStatus::Converged;
      return result;
    }
  }
  result.status = RegistrationStatus::IterationLimit;
  return result;
}

} // namespace holdfast
