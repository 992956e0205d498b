/// \file The ways to compute the covariance of an estimate.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

namespace holdfast {

/// How the covariance of the estimate is computed.
enum class CovarianceMode : std::uint8_t {
  /// First order through every stage, with the full Hessian of the cost (default).
  Exact,
  /// As Exact, with J^T J in place of the Hessian.
  GaussNewton,
  /// Exact, plus the second-order terms of the stages after the fit, with the shift of
  /// the mean. For few points and strong noise.
  SecondOrder,
  /// The paper's chain, eqs. (3) to (17), with its independence assumptions: errors
  /// that pixels share have no place in it, and of a sensor with a pattern it gives
  /// what independent errors of the same size would.
  Stagewise,
  /// Resample and refit, 1000 times: the referee
  /// (holdfast/uncertainty/monte_carlo.h).
  MonteCarlo,
  /// Exact, but SecondOrder for patches whose parameters are observable to second order
  /// alone (FitFlags). Of those it costs as much.
  Auto
};

/// Every mode, in the order of the enumeration.
inline constexpr std::array kAllCovarianceModes{CovarianceMode::Exact,
                                                CovarianceMode::GaussNewton,
                                                CovarianceMode::SecondOrder,
                                                CovarianceMode::Stagewise,
                                                CovarianceMode::MonteCarlo,
                                                CovarianceMode::Auto};

/// "exact", "gauss_newton", ... as in the program's JSON.
std::string_view covarianceModeName(CovarianceMode mode);

} // namespace holdfast
