#include "fit/fit_patch.h"
#include "parallel/parallel_for.h"
#include "parallel/thread_memory.h"

#include <holdfast/geometry/gaussian.h>

#include <holdfast/uncertainty/monte_carlo.h>

#include <Eigen/Cholesky>

#include <cmath>
#include <optional>
#include <stdexcept>

namespace holdfast {
namespace {

// Noise-free points and the noise to draw: errors of their own, N(0, S S^T) with the
// roots S, and those they share, e r_i with e = L n.
struct ErrorModel {
  Eigen::Vector3d origin, viewpoint;
  std::vector<Eigen::Vector3d> points;
  std::vector<Eigen::Matrix3d> covariances;
  std::vector<Eigen::Matrix3d> roots;
  std::shared_ptr<const CorrelatedNoise> pattern; // null: they share none
  std::vector<Eigen::Vector2d> pixels;
  std::vector<Eigen::Vector3d> directions;
  Eigen::MatrixXd shared_root; // L
};

void
copyPattern(const PointBatch& from, int i, PointBatch& to)
{
  for (int c = PointBatch::U; c <= PointBatch::EZ; ++c) {
    const auto channel = static_cast<PointBatch::Channel>(c);
    to.channel(channel)[to.size() - 1] = from.channel(channel)[i];
  }
}

// L L^T is the covariance of the shared errors over all pairs of points.
Eigen::MatrixXd
sharedRoot(const NoisePattern& pattern, const std::vector<Eigen::Vector2d>& pixels)
{
  const auto n = static_cast<Eigen::Index>(pixels.size());
  Eigen::MatrixXd C(n, n);
  for (Eigen::Index i = 0; i < n; ++i)
    for (Eigen::Index j = 0; j < n; ++j)
      C(i, j) = pattern.covariance(
          (pixels[static_cast<std::size_t>(i)] - pixels[static_cast<std::size_t>(j)])
              .norm());
  // Points in one place, and smooth waves, leave directions without variance.
  constexpr double kRounding = 1e-9;
  C.diagonal().array() += kRounding * pattern.variance();
  return C.llt().matrixL();
}

void
addShared(const PointBatch& valid, ErrorModel& model)
{
  const double variance = model.pattern->pattern().variance();
  for (int i = 0; i < valid.size(); ++i) {
    model.pixels.emplace_back(valid.channel(PointBatch::U)[i],
                              valid.channel(PointBatch::V)[i]);
    model.directions.emplace_back(valid.channel(PointBatch::EX)[i],
                                  valid.channel(PointBatch::EY)[i],
                                  valid.channel(PointBatch::EZ)[i]);
    const Eigen::Vector3d& r = model.directions.back();
    model.roots[static_cast<std::size_t>(i)] =
        squareRoot(valid.covariance(i) - variance * r * r.transpose());
  }
  model.shared_root = sharedRoot(model.pattern->pattern(), model.pixels);
}

ErrorModel
modelOf(const PointBatch& batch)
{
  PointBatch valid;
  valid.clear(batch.origin());
  ErrorModel model;
  model.pattern = batch.sharedPattern();
  valid.setPattern(model.pattern);
  for (int i = 0; i < batch.size(); ++i) {
    valid.add(batch.point(i), batch.covariance(i));
    if (model.pattern)
      copyPattern(batch, i, valid);
  }
  valid.removeInvalid();
  model.origin = batch.origin();
  model.viewpoint = batch.viewpoint();
  for (int i = 0; i < valid.size(); ++i) {
    model.points.push_back(valid.point(i));
    model.covariances.push_back(valid.covariance(i));
    model.roots.push_back(squareRoot(valid.covariance(i)));
  }
  if (model.pattern)
    addShared(valid, model);
  return model;
}

void
drawShared(const ErrorModel& model, std::mt19937_64& generator, PointBatch& batch)
{
  std::normal_distribution<double> normal;
  Eigen::VectorXd n(batch.size());
  for (double& number : n)
    number = normal(generator);
  const Eigen::VectorXd e = model.shared_root.triangularView<Eigen::Lower>() * n;
  for (int i = 0; i < batch.size(); ++i) {
    const auto at = static_cast<std::size_t>(i);
    batch.channel(PointBatch::U)[i] = model.pixels[at].x();
    batch.channel(PointBatch::V)[i] = model.pixels[at].y();
    for (int k = 0; k < 3; ++k) {
      const double r = model.directions[at][k];
      batch.channel(static_cast<PointBatch::Channel>(PointBatch::EX + k))[i] = r;
      batch.channel(static_cast<PointBatch::Channel>(PointBatch::X + k))[i] += r * e[i];
    }
  }
}

void
drawPoints(const ErrorModel& model, std::mt19937_64& generator, PointBatch& batch)
{
  batch.clear(model.origin, model.viewpoint);
  batch.setPattern(model.pattern);
  for (std::size_t i = 0; i < model.points.size(); ++i)
    batch.add(sampleGaussian(model.points[i], model.roots[i], generator),
              model.covariances[i]);
  if (model.pattern)
    drawShared(model, generator, batch);
}

// Mean and unbiased covariance, where there are two samples or more.
template <typename Vector, typename Matrix>
void
summarize(const std::vector<Vector>& samples, Vector& mean, Matrix& covariance)
{
  if (samples.size() < 2)
    return;
  const Eigen::Index n = samples.front().size();
  mean = Vector::Zero(n);
  for (const Vector& sample : samples)
    mean += sample;
  mean /= static_cast<double>(samples.size());
  covariance = Matrix::Zero(n, n);
  for (const Vector& sample : samples) {
    const Vector deviation = sample - mean;
    covariance += deviation * deviation.transpose();
  }
  covariance /= static_cast<double>(samples.size() - 1);
}

// One trial that converged.
struct Trial {
  ParameterVector parameters;
  StateVector state;
};

} // namespace

std::mt19937_64
trialGenerator(std::uint64_t seed, std::uint64_t trial)
{
  std::seed_seq sequence{seed, seed >> 32, trial, trial >> 32};
  return std::mt19937_64(sequence);
}

MonteCarloResult
monteCarloCovariance(const Patch& reference,
                     const PointBatch& batch,
                     const FitOptions& options,
                     const MonteCarloOptions& monte_carlo)
{
  if (monte_carlo.trials < 1)
    throw std::invalid_argument("a Monte Carlo run needs one trial or more");
  const PatchFitter fitter(withType(options, reference.type));
  const ErrorModel model = modelOf(batch);
  const PatchState about = toState(reference, options.containment);
  std::vector<std::optional<Trial>> trials(
      static_cast<std::size_t>(monte_carlo.trials));
  const auto work = [&](int trial, int) {
    auto& drawn = threadMemory<PointBatch, struct DrawnPoints>();
    std::mt19937_64 generator =
        trialGenerator(monte_carlo.seed, static_cast<std::uint64_t>(trial));
    drawPoints(model, generator, drawn);
    const PatchFit fit = fitter.fit(drawn);
    if (fit.status == FitStatus::Converged)
      trials[static_cast<std::size_t>(trial)] =
          Trial{pack(nearestRepresentation(fit.bounded.patch, reference)),
                difference(fit.bounded.state, about)};
  };
  parallelFor(monte_carlo.trials, monte_carlo.threads, work, monte_carlo.progress);

  MonteCarloResult result;
  for (const auto& trial : trials) {
    if (!trial) {
      ++result.failures;
      continue;
    }
    result.samples.push_back(trial->parameters);
    result.states.push_back(trial->state);
  }
  summarize(result.samples, result.mean, result.covariance);
  summarize(result.states, result.state_mean, result.state_covariance);
  return result;
}

} // namespace holdfast
