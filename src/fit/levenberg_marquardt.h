/// \file Damped Gauss-Newton (Levenberg-Marquardt) over a small problem.
#pragma once

#include "geometry/small_cholesky.h"

#include <Eigen/Core>

#include <algorithm>
#include <cmath>

namespace holdfast {

struct LevenbergMarquardtOptions {
  int max_iterations = 50;
  /// Stop when the Newton decrement sqrt(g^T H^-1 g) is below this. With a cost of half
  /// a chi-square, the decrement is the length of the remaining step in sigmas.
  double step_tolerance_sigma = 1e-4;
  /// Costs agree within this share near the minimum, where a step may not lower them.
  double cost_rounding = 1e-12;
};

struct LevenbergMarquardtSummary {
  enum class Stop { Converged, IterationLimit, Singular, NonFinite };
  Stop stop = Stop::IterationLimit;
  int iterations = 0;
};

/// Factor by which the diagonal is raised: none as long as plain Gauss-Newton works.
class Damping {
public:
  static constexpr double kFirst = 1e-3, kLargest = 1e12;

  double value() const
  {
    return value_;
  }

  bool exhausted() const
  {
    return value_ > kLargest;
  }

  void raise()
  {
    raised_ = true;
    value_ = std::max(10.0 * value_, kFirst);
  }

  /// After an accepted step. Where damping was needed just now, it will be again: lower
  /// it only after a step that was accepted at once.
  void lower()
  {
    if (!raised_)
      value_ = value_ <= kFirst ? 0.0 : value_ / 10.0;
    raised_ = false;
  }

private:
  double value_ = 0.0;
  bool raised_ = false; // since the last accepted step
};

/// Minimises a cost that the problem evaluates.
///
/// Problem has: `State`; `kSize`, the n below; `Evaluation` with members `cost`,
/// `gradient` (n) and `JtJ` (n x n); `void evaluate(const State&, Evaluation&) const`;
/// and `State retract(const State&, const Step&) const`.
///
/// \param state start; on return the solution, or the best state seen.
///
/// \param evaluation on return the evaluation there, or, when converged, within
///        step_tolerance_sigma of it.
template <typename Problem>
LevenbergMarquardtSummary
levenbergMarquardt(const Problem& problem,
                   const LevenbergMarquardtOptions& options,
                   typename Problem::State& state,
                   typename Problem::Evaluation& evaluation)
{
  using Stop = LevenbergMarquardtSummary::Stop;
  LevenbergMarquardtSummary summary;
  problem.evaluate(state, evaluation);
  if (!std::isfinite(evaluation.cost)) {
    summary.stop = Stop::NonFinite;
    return summary;
  }
  Damping damping;
  typename Problem::Evaluation trial;
  while (true) {
    auto damped = evaluation.JtJ;
    damped.diagonal() *= 1.0 + damping.value();
    const SmallCholesky<Problem::kSize> cholesky(damped);
    if (!cholesky.isPositive()) {
      summary.stop = Stop::Singular;
      if (damping.exhausted())
        return summary;
      damping.raise();
      continue;
    }
    const auto step = (-cholesky.solve(evaluation.gradient)).eval();
    const double decrement = std::sqrt(std::max(0.0, -step.dot(evaluation.gradient)));
    if (decrement < options.step_tolerance_sigma &&
        damping.value() <= Damping::kFirst) {
      // The last step is worth taking, but not another evaluation.
      state = problem.retract(state, step);
      summary.stop = Stop::Converged;
      return summary;
    }
    if (summary.iterations == options.max_iterations) {
      summary.stop = Stop::IterationLimit;
      return summary;
    }
    ++summary.iterations;
    const auto candidate = problem.retract(state, step);
    problem.evaluate(candidate, trial);
    if (trial.cost <= evaluation.cost * (1.0 + options.cost_rounding)) {
      state = candidate;
      evaluation = trial;
      damping.lower();
    }
    else {
      damping.raise();
      if (damping.exhausted()) {
        // No step in any direction lowers the cost: rounding is all that is left.
        summary.stop = Stop::Converged;
        return summary;
      }
    }
  }
}

} // namespace holdfast
