#include "fit/fit_patch.h"
#include "parallel/parallel_for.h"
#include <holdfast/geometry/gaussian.h>

#include <holdfast/uncertainty/monte_carlo.h>

#include <optional>
#include <stdexcept>

namespace holdfast {
namespace {

// Noise-free points and the noise to draw.
struct Model {
  Eigen::Vector3d origin, viewpoint;
  std::vector<Eigen::Vector3d> points;
  std::vector<Eigen::Matrix3d> covariances;
  std::vector<Eigen::Matrix3d> roots;
};

Model
modelOf(const PointBatch& batch)
{
  PointBatch valid;
  valid.clear(batch.origin());
  for (int i = 0; i < batch.size(); ++i)
    valid.add(batch.point(i), batch.covariance(i));
  valid.removeInvalid();
  Model model;
  model.origin = batch.origin();
  model.viewpoint = batch.viewpoint();
  for (int i = 0; i < valid.size(); ++i) {
    model.points.push_back(valid.point(i));
    model.covariances.push_back(valid.covariance(i));
    model.roots.push_back(squareRoot(valid.covariance(i)));
  }
  return model;
}

void
drawPoints(const Model& model, std::mt19937_64& generator, PointBatch& batch)
{
  batch.clear(model.origin, model.viewpoint);
  for (std::size_t i = 0; i < model.points.size(); ++i)
    batch.add(sampleGaussian(model.points[i], model.roots[i], generator),
              model.covariances[i]);
}

void
summarize(MonteCarloResult& result)
{
  const std::vector<ParameterVector>& samples = result.samples;
  if (samples.size() < 2)
    return;
  const Eigen::Index n = samples.front().size();
  result.mean = ParameterVector::Zero(n);
  for (const ParameterVector& sample : samples)
    result.mean += sample;
  result.mean /= static_cast<double>(samples.size());
  result.covariance = ParameterMatrix::Zero(n, n);
  for (const ParameterVector& sample : samples) {
    const ParameterVector deviation = sample - result.mean;
    result.covariance += deviation * deviation.transpose();
  }
  result.covariance /= static_cast<double>(samples.size() - 1);
}

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
  const Model model = modelOf(batch);
  std::vector<std::optional<ParameterVector>> trials(
      static_cast<std::size_t>(monte_carlo.trials));
  const auto work = [&](int trial, int) {
    thread_local PointBatch drawn;
    std::mt19937_64 generator =
        trialGenerator(monte_carlo.seed, static_cast<std::uint64_t>(trial));
    drawPoints(model, generator, drawn);
    const PatchFit fit = fitter.fit(drawn);
    if (fit.status == FitStatus::Converged)
      trials[static_cast<std::size_t>(trial)] =
          pack(nearestRepresentation(fit.bounded.patch, reference));
  };
  parallelFor(monte_carlo.trials, monte_carlo.threads, work, monte_carlo.progress);

  MonteCarloResult result;
  for (const auto& trial : trials) {
    if (trial)
      result.samples.push_back(*trial);
    else
      ++result.failures;
  }
  summarize(result);
  return result;
}

} // namespace holdfast
