#include "parallel/parallel_for.h"

#include <holdfast/evaluation/consistency.h>
#include <holdfast/fit/reference_points.h>
#include <holdfast/geometry/gaussian.h>
#include <holdfast/geometry/rotation.h>
#include <holdfast/uncertainty/monte_carlo.h>

#include <boost/math/distributions/chi_squared.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace holdfast {
namespace {

// The points of a scene's patch, in the camera frame and without noise.
struct TruePoints {
  Pose sensor_pose;
  std::vector<Eigen::Vector3d> points;
  std::vector<Eigen::Matrix3d> roots;
};

TruePoints
truePoints(const Scene& scene,
           const RayGrid& rays,
           const NoiseModel& noise,
           double noise_scale)
{
  RangeImage image = castRays(scene, rays);
  attachNoise(image, noise, noise_scale);
  TruePoints truth;
  truth.sensor_pose = image.sensor_pose;
  const Eigen::Matrix3d to_camera = image.sensor_pose.R.transpose();
  for (std::size_t i = 0; i < image.truth.size(); ++i)
    if (image.hits[i] == 0) {
      truth.points.push_back(image.sensor_pose.toLocal(image.truth[i]));
      truth.roots.push_back(to_camera * image.roots[i]);
    }
  return truth;
}

// Fills the batch in the world frame from measured points in the camera frame, with
// covariances from the model, at the surface if asked.
void
fillBatch(const std::vector<Eigen::Vector3d>& points,
          const TruePoints& truth,
          const NoiseModel& noise,
          double noise_scale,
          bool noise_at_surface,
          PointBatch& camera,
          PointBatch& batch)
{
  camera.clear(Eigen::Vector3d::Zero());
  for (const Eigen::Vector3d& q : points)
    camera.add(q, Eigen::Matrix3d::Zero());
  if (noise_at_surface)
    computeReferencePoints(camera, Eigen::Vector3d::Zero());
  const auto first = noise_at_surface ? PointBatch::RX : PointBatch::X;
  const Eigen::Matrix3d& R = truth.sensor_pose.R;
  batch.clear(truth.sensor_pose.toWorld(truth.points.front()), truth.sensor_pose.c);
  for (std::size_t i = 0; i < points.size(); ++i) {
    Eigen::Vector3d at;
    for (int k = 0; k < 3; ++k)
      at[k] = camera.channel(static_cast<PointBatch::Channel>(first + k))[i];
    batch.add(truth.sensor_pose.toWorld(points[i]),
              noise_scale * noise_scale * rotateCovariance(R, noise.covariance(at)));
  }
}

// Error of a patch in the tangent space [d | k | delta | c] of the reference.
ParameterVector
tangentError(const Patch& patch, const Patch& reference)
{
  const ParameterLayout layout = layoutOf(reference.type);
  ParameterVector error = pack(patch) - pack(reference);
  const Eigen::Vector3d delta =
      logMap(expMap(reference.r).transpose() * expMap(patch.r));
  error.segment(layout.r(), layout.r_count) = delta.head(layout.r_count);
  return error;
}

// [d | k | r | c] shift to the tangent space.
ParameterVector
tangentShift(const Patch& patch, const ParameterVector& shift)
{
  return tangentJacobian(patch) * shift;
}

struct Trial {
  enum class Outcome { Used, Switched, Failed };
  Outcome outcome = Outcome::Failed;
  bool wrong_type = false;
  // Tangent space. The region of confidence about the estimate plus the second-order
  // shift, where there is one, lies off the reference by error + shift.
  ParameterVector error, shift;
  ParameterMatrix covariance;
  // The same of the state, about the estimate and in its frame.
  StateVector state_error;
  StateMatrix state_covariance;
  double nonlinearity = 0.0;
  bool flagged = false;
};

constexpr std::array kColumnEdges{0.01,
                                  0.03,
                                  0.1,
                                  0.3,
                                  1.0,
                                  3.0,
                                  std::numeric_limits<double>::infinity()};

// x^T S^+ x and the rank of S.
struct Mahalanobis {
  double squared = 0.0;
  int rank = 0;
};

Mahalanobis
mahalanobis(const ParameterVector& x, const ParameterMatrix& S)
{
  // Parameters differ in unit: scale to correlations, so that one tolerance decides.
  constexpr double kNull = 1e-9;
  const ParameterVector inverse = S.diagonal().cwiseSqrt().cwiseInverse();
  const ParameterMatrix correlation = inverse.asDiagonal() * S * inverse.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<ParameterMatrix> solver(correlation);
  const ParameterVector y = solver.eigenvectors().transpose() * inverse.cwiseProduct(x);
  Mahalanobis result;
  for (int i = 0; i < y.size(); ++i)
    if (solver.eigenvalues()[i] > kNull) {
      result.squared += y[i] * y[i] / solver.eigenvalues()[i];
      ++result.rank;
    }
  return result;
}

// Squared error over the rank of its covariance, and whether the 95 % ellipsoid has it.
struct Normalized {
  double nees_per_dof = 0.0;
  bool within = false;
};

Normalized
normalized(const ParameterVector& error, const ParameterMatrix& covariance)
{
  const Mahalanobis m = mahalanobis(error, covariance);
  const boost::math::chi_squared chi2(m.rank);
  return {m.squared / m.rank, m.squared <= boost::math::quantile(chi2, 0.95)};
}

class TrialRunner {
public:
  TrialRunner(const TruePoints& truth,
              const NoiseModel& noise,
              const FitOptions& fit,
              PatchType type,
              const ConsistencyOptions& options)
  : truth_(truth)
  , noise_(noise)
  , options_(options)
  , estimator_(fit, options.mode)
  , free_estimator_(freeOptions(fit), CovarianceMode::GaussNewton)
  , type_(type)
  {}

  // The fit to the points without noise: their scatter has none to subtract.
  FitResult noiseFree(CovarianceMode mode, const FitOptions& fit) const
  {
    PointBatch camera, batch;
    fill(truth_.points, camera, batch);
    FitOptions options = fit;
    options.debias_scatter = false;
    return PatchEstimator(options, mode).estimate(batch);
  }

  Trial run(int index, const FitResult& noise_free) const
  {
    const Patch& reference = noise_free.patch;
    // A turn of more than this is a change of representation, not an error.
    constexpr double kSwitched = 0.785;
    std::mt19937_64 generator =
        trialGenerator(options_.seed, static_cast<std::uint64_t>(index));
    PointBatch camera, batch;
    std::vector<Eigen::Vector3d> points;
    drawNoise(truth_.points, truth_.roots, generator, points);
    fill(points, camera, batch);
    const FitResult fit = estimator_.estimate(batch);
    Trial trial;
    if (options_.count_type_errors)
      trial.wrong_type =
          free_estimator_.estimate(batch).patch.type.surface != type_.surface;
    if (!isUsable(fit.status))
      return trial;
    trial.error = tangentError(fit.patch, reference);
    trial.shift = fit.mean_shift.size() > 0 ? tangentShift(fit.patch, fit.mean_shift) :
                                              ParameterVector::Zero(trial.error.size());
    trial.covariance = toTangent(fit.patch, fit.covariance);
    trial.state_error = -difference(noise_free.state, fit.state);
    if (fit.state_mean_shift.size() > 0)
      trial.state_error += fit.state_mean_shift;
    trial.state_covariance = fit.state_covariance;
    trial.nonlinearity = fit.nonlinearity;
    trial.flagged = fit.flags.any();
    const ParameterLayout layout = layoutOf(type_);
    const double turn = layout.r_count == 3 ? trial.error[layout.r() + 2] : 0.0;
    trial.outcome =
        std::abs(turn) > kSwitched ? Trial::Outcome::Switched : Trial::Outcome::Used;
    return trial;
  }

private:
  static FitOptions freeOptions(FitOptions fit)
  {
    fit.surface = SurfaceRequest::Auto;
    return fit;
  }

  void fill(const std::vector<Eigen::Vector3d>& points,
            PointBatch& camera,
            PointBatch& batch) const
  {
    fillBatch(points,
              truth_,
              noise_,
              options_.noise_scale,
              options_.fit.noise_at_surface,
              camera,
              batch);
  }

  const TruePoints& truth_;
  const NoiseModel& noise_;
  const ConsistencyOptions& options_;
  PatchEstimator estimator_;
  PatchEstimator free_estimator_;
  PatchType type_;
};

std::vector<Trial>
runTrials(const TrialRunner& runner,
          const FitResult& reference,
          const ConsistencyOptions& options)
{
  std::vector<Trial> trials(static_cast<std::size_t>(options.trials));
  parallelFor(
      options.trials,
      options.threads,
      [&](int i, int) {
        trials[static_cast<std::size_t>(i)] = runner.run(i, reference);
      },
      options.progress);
  return trials;
}

std::vector<double>
toStd(const ParameterVector& v)
{
  return {v.data(), v.data() + v.size()};
}

void
summarize(const std::vector<Trial>& trials, ConsistencyResult& result)
{
  int used = 0;
  ParameterVector mean, predicted;
  for (const Trial& trial : trials) {
    result.type_error_rate += trial.wrong_type;
    result.switch_rate += trial.outcome == Trial::Outcome::Switched;
    result.failure_rate += trial.outcome == Trial::Outcome::Failed;
    if (trial.outcome != Trial::Outcome::Used)
      continue;
    if (used++ == 0) {
      mean = ParameterVector::Zero(trial.error.size());
      predicted = mean;
    }
    mean += trial.error;
    predicted += trial.covariance.diagonal();
  }
  result.trials = static_cast<int>(trials.size());
  const double inverse_trials = 1.0 / result.trials;
  result.type_error_rate *= inverse_trials;
  result.switch_rate *= inverse_trials;
  result.failure_rate *= inverse_trials;
  if (used < 2)
    return;
  mean /= used;
  predicted /= used;
  ParameterVector variance = ParameterVector::Zero(mean.size());
  for (const Trial& trial : trials) {
    if (trial.outcome != Trial::Outcome::Used)
      continue;
    variance += (trial.error - mean).cwiseAbs2();
    const Normalized about_fit =
        normalized(trial.error + trial.shift, trial.covariance);
    const Mahalanobis about_mean = mahalanobis(trial.error - mean, trial.covariance);
    result.nees_per_dof += about_fit.nees_per_dof / used;
    result.nees_per_dof_about_mean += about_mean.squared / about_mean.rank / used;
    result.coverage95 += static_cast<double>(about_fit.within) / used;
  }
  variance /= used - 1;
  const ParameterVector sigma = variance.cwiseSqrt();
  result.sigma_ratio = toStd(predicted.cwiseSqrt().cwiseQuotient(sigma));
  result.bias_sigma = toStd(mean.cwiseQuotient(sigma));
  result.bias_after_shift_sigma = result.bias_sigma;
}

// A running mean.
void
average(double& mean, double value, int count)
{
  mean += (value - mean) / count;
}

// The curvature matrix of a cylinder has rank one: what its entries have beside their
// two free numbers, kxx - kyy and kxy, is no coordinate.
StateMatrix
freeCoordinates(PatchType type)
{
  const StateLayout layout = stateLayoutOf(type);
  StateMatrix T = StateMatrix::Identity(layout.size(), layout.size());
  if (type.surface != SurfaceType::CircularCylinder)
    return T;
  const int k = layout.k(), rest = layout.size() - k - 3;
  StateMatrix free = StateMatrix::Zero(layout.size() - 1, layout.size());
  free.topLeftCorner(k, k).setIdentity();
  free(k, k) = 1.0;
  free(k, k + 2) = -1.0;
  free(k + 1, k + 1) = 1.0;
  free.bottomRightCorner(rest, rest).setIdentity();
  return free;
}

void
summarizeStates(const std::vector<Trial>& trials,
                PatchType type,
                ConsistencyResult& result)
{
  for (const double edge : kColumnEdges)
    result.by_nonlinearity.push_back({edge, 0, 0.0, 0.0, 0.0});
  const StateMatrix T = freeCoordinates(type);
  std::array<int, kColumnEdges.size()> with_parameters{};
  int usable = 0, unflagged = 0;
  for (const Trial& trial : trials) {
    if (trial.outcome == Trial::Outcome::Failed)
      continue;
    ++usable;
    const Normalized state =
        normalized(T * trial.state_error, T * trial.state_covariance * T.transpose());
    average(result.state_nees_per_dof, state.nees_per_dof, usable);
    average(result.state_coverage95, state.within, usable);
    const auto at = static_cast<std::size_t>(
        std::lower_bound(kColumnEdges.begin(), kColumnEdges.end(), trial.nonlinearity) -
        kColumnEdges.begin());
    ConsistencyColumn& column =
        result.by_nonlinearity[std::min(at, kColumnEdges.size() - 1)];
    ++column.trials;
    average(column.state_nees_per_dof, state.nees_per_dof, column.trials);
    average(column.state_coverage95, state.within, column.trials);
    if (trial.outcome == Trial::Outcome::Switched)
      continue;
    const Normalized parameters =
        normalized(trial.error + trial.shift, trial.covariance);
    average(column.nees_per_dof, parameters.nees_per_dof, ++with_parameters[at]);
    if (!trial.flagged)
      average(result.unflagged_nees_per_dof, parameters.nees_per_dof, ++unflagged);
  }
  result.unflagged_rate = usable > 0 ? static_cast<double>(unflagged) / usable : 0.0;
}

} // namespace

ConsistencyResult
pooled(const std::vector<ConsistencyResult>& results)
{
  ConsistencyResult all;
  double points = 0.0;
  int usable = 0, unflagged = 0;
  for (const double edge : kColumnEdges)
    all.by_nonlinearity.push_back({edge, 0, 0.0, 0.0, 0.0});
  const auto add = [](double& mean, int& count, double other, int more) {
    count += more;
    if (count > 0)
      mean += (other - mean) * more / count;
  };
  for (const ConsistencyResult& one : results) {
    int before = all.trials;
    const auto addRate = [&](double& mean, double other) {
      int count = before;
      add(mean, count, other, one.trials);
    };
    addRate(points, one.points);
    addRate(all.nees_per_dof, one.nees_per_dof);
    addRate(all.nees_per_dof_about_mean, one.nees_per_dof_about_mean);
    addRate(all.coverage95, one.coverage95);
    addRate(all.type_error_rate, one.type_error_rate);
    addRate(all.switch_rate, one.switch_rate);
    addRate(all.failure_rate, one.failure_rate);
    all.trials += one.trials;
    const int used =
        static_cast<int>(std::lround((1.0 - one.failure_rate) * one.trials));
    int count = usable;
    add(all.state_nees_per_dof, count, one.state_nees_per_dof, used);
    add(all.state_coverage95, usable, one.state_coverage95, used);
    add(all.unflagged_nees_per_dof,
        unflagged,
        one.unflagged_nees_per_dof,
        static_cast<int>(std::lround(one.unflagged_rate * used)));
    for (std::size_t i = 0; i < kColumnEdges.size(); ++i) {
      ConsistencyColumn& column = all.by_nonlinearity[i];
      const ConsistencyColumn& other = one.by_nonlinearity[i];
      int of_state = column.trials, of_coverage = column.trials;
      add(column.state_nees_per_dof, of_state, other.state_nees_per_dof, other.trials);
      add(column.state_coverage95, of_coverage, other.state_coverage95, other.trials);
      add(column.nees_per_dof, column.trials, other.nees_per_dof, other.trials);
    }
  }
  all.points = static_cast<int>(std::lround(points));
  all.unflagged_rate = usable > 0 ? static_cast<double>(unflagged) / usable : 0.0;
  return all;
}

ConsistencyResult
checkConsistency(const Scene& scene,
                 const RayGrid& rays,
                 const NoiseModel& noise,
                 const ConsistencyOptions& options)
{
  if (scene.patches.empty())
    throw std::invalid_argument("the scene has no patch to fit");
  if (options.trials < 2)
    throw std::invalid_argument("a consistency check needs at least two trials");
  if (!(options.noise_scale > 0.0))
    throw std::invalid_argument("noise_scale must be positive");
  const PatchType type = scene.patches[0].type;
  const TruePoints truth = truePoints(scene, rays, noise, options.noise_scale);
  if (truth.points.empty())
    throw std::invalid_argument("the sensor does not see the patch");
  const FitOptions fit = withType(options.fit, type);

  const TrialRunner runner(truth, noise, fit, type, options);
  const FitResult reference = runner.noiseFree(CovarianceMode::SecondOrder, fit);
  if (!isUsable(reference.status))
    throw std::invalid_argument("the noise-free points do not determine the patch: " +
                                std::string(statusName(reference.status)));
  ConsistencyResult result;
  result.points = reference.points;
  const std::vector<Trial> trials = runTrials(runner, reference, options);
  summarize(trials, result);
  summarizeStates(trials, type, result);
  const ParameterVector shift = tangentShift(reference.patch, reference.mean_shift);
  for (std::size_t i = 0; i < result.bias_sigma.size(); ++i) {
    const double predicted = std::sqrt(toTangent(reference.patch, reference.covariance)
                                           .diagonal()[static_cast<Eigen::Index>(i)]);
    const double sigma = predicted / result.sigma_ratio[i];
    result.bias_after_shift_sigma[i] -= shift[static_cast<Eigen::Index>(i)] / sigma;
  }
  return result;
}

} // namespace holdfast
