/// \file Damped Gauss-Newton (Levenberg-Marquardt) over a small problem.
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>

#include <algorithm>
#include <cmath>

namespace holdfast {

struct LevenbergMarquardtOptions {
  int max_iterations = 50;
  /// Stop when the Newton decrement sqrt(g^T H^-1 g) is below this. With a cost of half
  /// a chi-square, the decrement is the length of the remaining step in sigmas.
  double step_tolerance_sigma = 1e-4;
};

struct LevenbergMarquardtSummary {
  enum class Stop { Converged, IterationLimit, Singular, NonFinite };
  Stop stop = Stop::IterationLimit;
  int iterations = 0;
};

/// Minimises a cost that the problem evaluates.
///
/// Problem has: `State`; `Evaluation` with members `cost`, `gradient` (n) and `JtJ`
/// (n x n); `void evaluate(const State&, Evaluation&) const`; and
/// `State retract(const State&, const Step&) const`.
/// \param state start; on return the solution, or the best state seen.
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
  constexpr double kFirstDamping = 1e-3, kLargestDamping = 1e12;
  // Costs agree within rounding near the minimum, where a step may not lower them.
  constexpr double kRounding = 1e-12;

  LevenbergMarquardtSummary summary;
  problem.evaluate(state, evaluation);
  if (!std::isfinite(evaluation.cost)) {
    summary.stop = Stop::NonFinite;
    return summary;
  }
  double damping = 0.0;
  bool rejected = false; // since the last accepted step
  typename Problem::Evaluation trial;
  while (true) {
    auto damped = evaluation.JtJ;
    damped.diagonal() *= 1.0 + damping;
    const auto cholesky = damped.llt();
    if (cholesky.info() != Eigen::Success) {
      summary.stop = Stop::Singular;
      if (damping >= kLargestDamping)
        return summary;
      damping = std::max(10.0 * damping, kFirstDamping);
      continue;
    }
    const auto step = (-cholesky.solve(evaluation.gradient)).eval();
    const double decrement = std::sqrt(std::max(0.0, -step.dot(evaluation.gradient)));
    if (decrement < options.step_tolerance_sigma && damping <= kFirstDamping) {
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
    if (trial.cost <= evaluation.cost * (1.0 + kRounding)) {
      state = candidate;
      evaluation = trial;
      // Where damping was needed just now, it will be again: lower it only after a step
      // that was accepted at once.
      if (!rejected)
        damping = damping <= kFirstDamping ? 0.0 : damping / 10.0;
      rejected = false;
    }
    else {
      rejected = true;
      damping = std::max(10.0 * damping, kFirstDamping);
      if (damping > kLargestDamping) {
        // No step in any direction lowers the cost: rounding is all that is left.
        summary.stop = Stop::Converged;
        return summary;
      }
    }
  }
}

} // namespace holdfast
