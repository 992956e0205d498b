#include "evaluation/fit_error.h"
#include "parallel/parallel_for.h"

#include <holdfast/evaluation/consistency.h>
#include <holdfast/fit/reference_points.h>
#include <holdfast/geometry/gaussian.h>
#include <holdfast/uncertainty/monte_carlo.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <stdexcept>

namespace holdfast {
namespace {

// The points of a scene's patch, in the camera frame and without noise.
struct TruePoints {
  Pose sensor_pose;
  std::vector<Eigen::Vector3d> points;
  std::vector<Eigen::Matrix3d> roots;
  // What neighbours share: over a rectangle of pixels, of which the points are those,
  // and how each moves with it. Null: nothing.
  std::shared_ptr<const PatternField> field;
  std::vector<std::size_t> pixels;
  std::vector<Eigen::Vector3d> directions;
};

// The part of the image that the first patch fills, with nothing else in it.
RangeImage
cropped(const RangeImage& image)
{
  int low_u = image.width, low_v = image.height, high_u = -1, high_v = -1;
  for (int v = 0; v < image.height; ++v)
    for (int u = 0; u < image.width; ++u)
      if (image.hits[static_cast<std::size_t>(v * image.width + u)] == 0) {
        low_u = std::min(low_u, u);
        high_u = std::max(high_u, u);
        low_v = std::min(low_v, v);
        high_v = std::max(high_v, v);
      }
  RangeImage part;
  part.sensor_pose = image.sensor_pose;
  part.width = std::max(0, high_u - low_u + 1);
  part.height = std::max(0, high_v - low_v + 1);
  for (int v = low_v; v <= high_v; ++v)
    for (int u = low_u; u <= high_u; ++u) {
      const auto i = static_cast<std::size_t>(v * image.width + u);
      part.directions.push_back(image.directions[i]);
      part.hits.push_back(image.hits[i] == 0 ? 0 : -1);
      part.truth.push_back(image.truth[i]);
    }
  part.points = part.truth;
  part.covariances.assign(part.truth.size(), Eigen::Matrix3d::Zero());
  part.roots = part.covariances;
  return part;
}

TruePoints
truePoints(const Scene& scene,
           const RayGrid& rays,
           const Sensor& sensor,
           double noise_scale)
{
  RangeImage image = cropped(castRays(scene, rays));
  TruePoints truth;
  truth.sensor_pose = image.sensor_pose;
  if (image.truth.empty())
    return truth;
  attachNoise(image, sensor, noise_scale);
  truth.field = image.pattern;
  const Eigen::Matrix3d to_camera = image.sensor_pose.R.transpose();
  for (std::size_t i = 0; i < image.truth.size(); ++i) {
    if (image.hits[i] != 0)
      continue;
    truth.points.push_back(image.sensor_pose.toLocal(image.truth[i]));
    truth.roots.push_back(to_camera * image.roots[i]);
    truth.pixels.push_back(i);
    if (truth.field)
      truth.directions.push_back(to_camera * image.pattern_directions[i]);
  }
  return truth;
}

// Draws the points with noise, camera frame.
void
drawPoints(const TruePoints& truth,
           std::mt19937_64& generator,
           std::vector<Eigen::Vector3d>& points)
{
  drawNoise(truth.points, truth.roots, generator, points);
  if (!truth.field)
    return;
  std::vector<double> field;
  truth.field->draw(generator, field);
  for (std::size_t i = 0; i < points.size(); ++i)
    points[i] += field[truth.pixels[i]] * truth.directions[i];
}

// Fills batches in the world frame from measured points in the camera frame, with
// covariances from the sensor's model, at the surface if asked, and its pattern.
class BatchFiller {
public:
  BatchFiller(const Pose& sensor_pose,
              const Sensor& sensor,
              double noise_scale,
              bool noise_at_surface)
  : sensor_pose_(sensor_pose)
  , sensor_(sensor)
  , noise_scale_(noise_scale)
  , noise_at_surface_(noise_at_surface)
  {
    if (!sensor.pattern.empty())
      pattern_ = std::make_shared<const CorrelatedNoise>(sensor.pattern);
  }

  void fill(const std::vector<Eigen::Vector3d>& points, PointBatch& batch) const
  {
    PointBatch camera;
    camera.clear(Eigen::Vector3d::Zero());
    for (const Eigen::Vector3d& q : points)
      camera.add(q, Eigen::Matrix3d::Zero());
    if (noise_at_surface_)
      computeReferencePoints(camera, Eigen::Vector3d::Zero());
    const auto first = noise_at_surface_ ? PointBatch::RX : PointBatch::X;
    batch.clear(sensor_pose_.toWorld(points.front()), sensor_pose_.c);
    batch.setPattern(pattern_);
    for (std::size_t i = 0; i < points.size(); ++i) {
      Eigen::Vector3d at;
      for (int k = 0; k < 3; ++k)
        at[k] = camera.channel(static_cast<PointBatch::Channel>(first + k))[i];
      batch.add(sensor_pose_.toWorld(points[i]),
                noise_scale_ * noise_scale_ *
                    rotateCovariance(sensor_pose_.R, sensor_.noise->covariance(at)));
      if (pattern_)
        share(points[i], at, i, batch);
    }
  }

private:
  // \param at where the model is evaluated.
  void share(const Eigen::Vector3d& point,
             const Eigen::Vector3d& at,
             std::size_t i,
             PointBatch& batch) const
  {
    const Eigen::Vector2d pixel = sensor_.camera.project(point);
    batch.channel(PointBatch::U)[i] = pixel.x();
    batch.channel(PointBatch::V)[i] = pixel.y();
    const Eigen::Vector3d direction =
        noise_scale_ * sensor_pose_.R * sensor_.noise->patternDirection(at);
    for (int k = 0; k < 3; ++k)
      batch.channel(static_cast<PointBatch::Channel>(PointBatch::EX + k))[i] =
          direction[k];
  }

  const Pose& sensor_pose_;
  const Sensor& sensor_;
  double noise_scale_;
  bool noise_at_surface_;
  std::shared_ptr<const CorrelatedNoise> pattern_;
};

struct Trial {
  enum class Outcome { Used, Switched, Failed };
  Outcome outcome = Outcome::Failed;
  bool wrong_type = false;
  // Tangent space [d | k | delta | c].
  ParameterVector error;
  ParameterMatrix covariance;
  NormalizedError parameters, state;
  StateTallies parts;
  double nonlinearity = 0.0;
  double curvature_in_sigmas = 0.0;
  bool flagged = false;
};

constexpr double kNoEnd = std::numeric_limits<double>::infinity();
constexpr std::array kNonlinearityEdges{0.01, 0.03, 0.1, 0.3, 1.0, 3.0, kNoEnd};
constexpr std::array kCurvatureEdges{3.0, 6.0, 12.0, 20.0, 50.0, kNoEnd};

template <std::size_t n>
std::vector<ConsistencyColumn>
emptyColumns(const std::array<double, n>& edges)
{
  std::vector<ConsistencyColumn> columns;
  for (const double edge : edges)
    columns.push_back({edge, {}, {}});
  return columns;
}

class TrialRunner {
public:
  TrialRunner(const TruePoints& truth,
              const Sensor& sensor,
              const FitOptions& fit,
              PatchType type,
              const ConsistencyOptions& options)
  : truth_(truth)
  , options_(options)
  , filler_(truth.sensor_pose, sensor, options.noise_scale, fit.noise_at_surface)
  , estimator_(fit, options.mode)
  , free_estimator_(freeOptions(fit), CovarianceMode::GaussNewton)
  , type_(type)
  {}

  // The fit to the points without noise: their scatter has none to subtract.
  FitResult noiseFree(CovarianceMode mode, const FitOptions& fit) const
  {
    PointBatch batch;
    filler_.fill(truth_.points, batch);
    FitOptions options = fit;
    options.debias_scatter = false;
    return PatchEstimator(options, mode).estimate(batch);
  }

  Trial run(int index, const FitResult& noise_free) const
  {
    std::mt19937_64 generator =
        trialGenerator(options_.seed, static_cast<std::uint64_t>(index));
    PointBatch batch;
    std::vector<Eigen::Vector3d> points;
    drawPoints(truth_, generator, points);
    filler_.fill(points, batch);
    const FitResult fit = estimator_.estimate(batch);
    Trial trial;
    if (options_.count_type_errors)
      trial.wrong_type =
          free_estimator_.estimate(batch).patch.type.surface != type_.surface;
    if (isUsable(fit.status))
      judge(fit, noise_free, trial);
    return trial;
  }

private:
  static FitOptions freeOptions(FitOptions fit)
  {
    fit.surface = SurfaceRequest::Auto;
    return fit;
  }

  void judge(const FitResult& fit, const FitResult& noise_free, Trial& trial) const
  {
    // A turn of more than this is a change of representation, not an error.
    constexpr double kSwitched = 0.785;
    trial.error = tangentError(fit.patch, noise_free.patch);
    trial.covariance = toTangent(fit.patch, fit.covariance);
    trial.parameters = parameterError(fit, noise_free.patch);
    trial.state = stateError(fit, noise_free.state);
    addGroupErrors(fit, noise_free.state, trial.parts);
    trial.nonlinearity = fit.nonlinearity;
    trial.curvature_in_sigmas = curvatureInSigmas(fit);
    trial.flagged = fit.flags.any();
    const ParameterLayout layout = layoutOf(type_);
    const double turn = layout.r_count == 3 ? trial.error[layout.r() + 2] : 0.0;
    trial.outcome =
        std::abs(turn) > kSwitched ? Trial::Outcome::Switched : Trial::Outcome::Used;
  }

  const TruePoints& truth_;
  const ConsistencyOptions& options_;
  BatchFiller filler_;
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
    const Mahalanobis about_mean = mahalanobis(trial.error - mean, trial.covariance);
    result.nees_per_dof += trial.parameters.nees_per_dof / used;
    result.nees_per_dof_about_mean += about_mean.squared / about_mean.rank / used;
    result.coverage95 += static_cast<double>(trial.parameters.within95) / used;
  }
  variance /= used - 1;
  const ParameterVector sigma = variance.cwiseSqrt();
  result.sigma_ratio = toStd(predicted.cwiseSqrt().cwiseQuotient(sigma));
  result.bias_sigma = toStd(mean.cwiseQuotient(sigma));
  result.bias_after_shift_sigma = result.bias_sigma;
}

ConsistencyColumn&
columnOf(double value, std::vector<ConsistencyColumn>& columns)
{
  for (ConsistencyColumn& column : columns)
    if (value <= column.up_to)
      return column;
  return columns.back(); // a NaN
}

void
addTo(ConsistencyColumn& column, const Trial& trial)
{
  add(column.state, trial.state);
  if (trial.outcome == Trial::Outcome::Used)
    add(column.parameters, trial.parameters);
}

void
summarizeStates(const std::vector<Trial>& trials,
                PatchType type,
                ConsistencyResult& result)
{
  result.by_nonlinearity = emptyColumns(kNonlinearityEdges);
  if (curvatureParameterCount(type.surface) == 1)
    result.by_curvature = emptyColumns(kCurvatureEdges);
  ErrorTally state, unflagged;
  for (const Trial& trial : trials) {
    if (trial.outcome == Trial::Outcome::Failed)
      continue;
    add(state, trial.state);
    add(result.parts, trial.parts);
    add(trial.flagged ? result.flagged_state : result.unflagged_state, trial.state);
    addTo(columnOf(trial.nonlinearity, result.by_nonlinearity), trial);
    if (!result.by_curvature.empty())
      addTo(columnOf(trial.curvature_in_sigmas, result.by_curvature), trial);
    if (trial.outcome == Trial::Outcome::Used && !trial.flagged)
      add(unflagged, trial.parameters);
  }
  result.state_nees_per_dof = state.nees_per_dof;
  result.state_coverage95 = state.coverage95;
  result.unflagged_nees_per_dof = unflagged.nees_per_dof;
  result.unflagged_rate =
      state.count > 0 ? static_cast<double>(unflagged.count) / state.count : 0.0;
}

// Of one check, as it was counted before it was divided.
ErrorTally
tallyOf(double trials, double nees_per_dof, double coverage95)
{
  return {static_cast<int>(std::lround(trials)), nees_per_dof, coverage95};
}

void
addColumns(std::vector<ConsistencyColumn>& columns,
           const std::vector<ConsistencyColumn>& others)
{
  if (columns.empty())
    columns = others;
  else
    for (std::size_t i = 0; i < others.size(); ++i) {
      add(columns[i].state, others[i].state);
      add(columns[i].parameters, others[i].parameters);
    }
}

// Means over all trials, whatever came of them.
void
addRates(ConsistencyResult& all, const ConsistencyResult& one)
{
  all.trials += one.trials;
  const double share = static_cast<double>(one.trials) / all.trials;
  for (double ConsistencyResult::*rate : {&ConsistencyResult::nees_per_dof_about_mean,
                                          &ConsistencyResult::type_error_rate,
                                          &ConsistencyResult::switch_rate,
                                          &ConsistencyResult::failure_rate})
    all.*rate += share * (one.*rate - all.*rate);
}

} // namespace

ConsistencyResult
pooled(const std::vector<ConsistencyResult>& results)
{
  ConsistencyResult all;
  double points = 0.0;
  ErrorTally parameters, state, unflagged;
  for (const ConsistencyResult& one : results) {
    addRates(all, one);
    points += static_cast<double>(one.points) * one.trials;
    const double usable = (1.0 - one.failure_rate) * one.trials;
    add(parameters,
        tallyOf(usable - one.switch_rate * one.trials,
                one.nees_per_dof,
                one.coverage95));
    add(state, tallyOf(usable, one.state_nees_per_dof, one.state_coverage95));
    add(unflagged,
        tallyOf(one.unflagged_rate * usable, one.unflagged_nees_per_dof, 0.0));
    add(all.unflagged_state, one.unflagged_state);
    add(all.flagged_state, one.flagged_state);
    add(all.parts, one.parts);
    addColumns(all.by_nonlinearity, one.by_nonlinearity);
    addColumns(all.by_curvature, one.by_curvature);
  }
  all.nees_per_dof = parameters.nees_per_dof;
  all.coverage95 = parameters.coverage95;
  all.state_nees_per_dof = state.nees_per_dof;
  all.state_coverage95 = state.coverage95;
  all.unflagged_nees_per_dof = unflagged.nees_per_dof;
  all.unflagged_rate =
      state.count > 0 ? static_cast<double>(unflagged.count) / state.count : 0.0;
  if (all.trials > 0)
    all.points = static_cast<int>(std::lround(points / all.trials));
  return all;
}

ConsistencyResult
checkConsistency(const Scene& scene,
                 const RayGrid& rays,
                 const Sensor& sensor,
                 const ConsistencyOptions& options)
{
  if (scene.patches.empty())
    throw std::invalid_argument("the scene has no patch to fit");
  if (options.trials < 2)
    throw std::invalid_argument("a consistency check needs at least two trials");
  if (!(options.noise_scale > 0.0))
    throw std::invalid_argument("noise_scale must be positive");
  const PatchType type = scene.patches[0].type;
  const TruePoints truth = truePoints(scene, rays, sensor, options.noise_scale);
  if (truth.points.empty())
    throw std::invalid_argument("the sensor does not see the patch");
  const FitOptions fit = withType(options.fit, type);

  const TrialRunner runner(truth, sensor, fit, type, options);
  const FitResult reference = runner.noiseFree(CovarianceMode::SecondOrder, fit);
  if (!isUsable(reference.status))
    throw std::invalid_argument("the noise-free points do not determine the patch: " +
                                std::string(statusName(reference.status)));
  ConsistencyResult result;
  result.points = reference.points;
  const std::vector<Trial> trials = runTrials(runner, reference, options);
  summarize(trials, result);
  summarizeStates(trials, type, result);
  const ParameterVector shift = tangentShift(reference);
  for (std::size_t i = 0; i < result.bias_sigma.size(); ++i) {
    const double predicted = std::sqrt(toTangent(reference.patch, reference.covariance)
                                           .diagonal()[static_cast<Eigen::Index>(i)]);
    const double sigma = predicted / result.sigma_ratio[i];
    result.bias_after_shift_sigma[i] -= shift[static_cast<Eigen::Index>(i)] / sigma;
  }
  return result;
}

ConsistencyResult
checkConsistency(const Scene& scene,
                 const RayGrid& rays,
                 const NoiseModel& noise,
                 const ConsistencyOptions& options)
{
  Sensor sensor;
  // No owner: the caller's outlives the call.
  sensor.noise = NoiseModel::ConstPtr(NoiseModel::ConstPtr(), &noise);
  return checkConsistency(scene, rays, sensor, options);
}

} // namespace holdfast
