#include "contact/gaussian_events.h"

#include <holdfast/geometry/constants.h>

#include <Eigen/Eigenvalues>
#include <boost/math/quadrature/gauss.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace holdfast::contact {
namespace {

/// Cubic Hermite interpolation over [-kReach, kReach]: its error is at most
/// step^4 / 384 times the largest fourth derivative, 1.4: 6e-8.
class CdfTable {
public:
  static constexpr int kPerUnit = 16, kReach = 8, kNodes = 2 * kReach * kPerUnit + 1;

  CdfTable()
  {
    for (int i = 0; i < kNodes; ++i) {
      const double x = static_cast<double>(i) / kPerUnit - kReach;
      nodes_[static_cast<std::size_t>(i)] = {0.5 * std::erfc(-x / std::sqrt(2.0)),
                                             normalDensity(x) / kPerUnit};
    }
  }

  double at(double x) const
  {
    if (!(x > -kReach))
      return 0.0;
    if (x >= kReach)
      return 1.0;
    const double scaled = (x + kReach) * kPerUnit;
    const int i = static_cast<int>(scaled);
    const double t = scaled - i, u = 1.0 - t;
    const Node& a = nodes_[static_cast<std::size_t>(i)];
    const Node& b = nodes_[static_cast<std::size_t>(i) + 1];
    return u * u * ((1.0 + 2.0 * t) * a.value + t * a.slope) +
           t * t * ((3.0 - 2.0 * t) * b.value - u * b.slope);
  }

private:
  struct Node {
    double value, slope;
  };
  std::array<Node, kNodes> nodes_;
};

using Gauss24 = boost::math::quadrature::gauss<double, 24>;

/// Gauss-Legendre over [low, high].
template <typename Function>
double
integrate(double low, double high, const Function& f)
{
  const double middle = 0.5 * (low + high), half = 0.5 * (high - low);
  double sum = 0.0;
  for (std::size_t i = 0; i < Gauss24::abscissa().size(); ++i) {
    const double step = half * Gauss24::abscissa()[i];
    sum += Gauss24::weights()[i] * (f(middle - step) + f(middle + step));
  }
  return half * sum;
}

/// Standard deviations below this are those of numbers that are known: slopes are told
/// to 1e-4 at best.
constexpr double kKnown = 1e-9;

/// Of a plane vector: independent along its principal axes.
struct Principal {
  Eigen::Vector2d mean, sigma; ///< the smaller sigma first

  Principal(const Eigen::Vector2d& m, const Eigen::Matrix2d& S)
  {
    Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> solver;
    solver.computeDirect(S);
    mean = solver.eigenvectors().transpose() * m;
    sigma = solver.eigenvalues().cwiseMax(kKnown * kKnown).cwiseSqrt();
  }
};

/// Beyond this many sigmas a Gaussian has 2e-9.
constexpr double kTail = 6.0;

double
discProbability(const Principal& g, double radius)
{
  // Along the axis of the smaller sigma, where the other one's probability changes
  // slowly; as radius * sin(t), so that its chord ends without a singularity.
  const double low = std::max(-radius, g.mean[0] - kTail * g.sigma[0]);
  const double high = std::min(radius, g.mean[0] + kTail * g.sigma[0]);
  if (low >= high)
    return 0.0;
  const auto density = [&](double t) {
    const double x = radius * std::sin(t), y = radius * std::cos(t);
    const double chord = normalCdf((y - g.mean[1]) / g.sigma[1]) -
                         normalCdf((-y - g.mean[1]) / g.sigma[1]);
    return normalDensity((x - g.mean[0]) / g.sigma[0]) / g.sigma[0] * y * chord;
  };
  return std::clamp(
      integrate(std::asin(low / radius), std::asin(high / radius), density),
      0.0,
      1.0);
}

/// P(|g| > mu) as the mean over mu: smooth where g is known worse than mu.
double
slipOverFriction(const Principal& g, const LogFriction& mu)
{
  const auto density = [&](double z) {
    return normalDensity(z) *
           (1.0 - discProbability(g, std::exp(mu.mean + mu.sigma * z)));
  };
  return integrate(-kTail, kTail, density);
}

/// The same as the mean over g: smooth where mu is known worse.
double
slipOverSlope(const Principal& g, const LogFriction& mu)
{
  const auto along = [&](double u) {
    const double x = g.mean[0] + g.sigma[0] * u;
    const auto across = [&](double v) {
      const double y = g.mean[1] + g.sigma[1] * v;
      const double slope = std::max(std::hypot(x, y), kKnown);
      return normalDensity(v) * normalCdf((std::log(slope) - mu.mean) / mu.sigma);
    };
    return normalDensity(u) * integrate(-kTail, kTail, across);
  };
  return integrate(-kTail, kTail, along);
}

} // namespace

double
normalCdf(double x)
{
  static const CdfTable table;
  return table.at(x);
}

double
normalDensity(double x)
{
  static const double kScale = 1.0 / std::sqrt(2.0 * kPi);
  return kScale * std::exp(-0.5 * x * x);
}

double
outsideProbability(double mean, double sigma, double limit)
{
  if (sigma <= 0.0)
    return std::abs(mean) > limit ? 1.0 : 0.0;
  return normalCdf((-limit - mean) / sigma) + normalCdf((mean - limit) / sigma);
}

double
discProbability(const Eigen::Vector2d& mean,
                const Eigen::Matrix2d& covariance,
                double radius)
{
  return discProbability(Principal(mean, covariance), radius);
}

LogFriction::LogFriction(const Friction& friction)
{
  const double variance = std::log1p(std::pow(friction.sigma / friction.mean, 2));
  mean = std::log(friction.mean) - 0.5 * variance;
  sigma = std::sqrt(variance);
}

double
slipProbability(const Eigen::Vector2d& mean,
                const Eigen::Matrix2d& covariance,
                const Friction& friction)
{
  const Principal g(mean, covariance);
  if (friction.sigma == 0.0)
    return 1.0 - discProbability(g, friction.mean);
  const LogFriction mu(friction);
  return friction.sigma < g.sigma[1] ? slipOverFriction(g, mu) : slipOverSlope(g, mu);
}

double
tailMean(const std::vector<GaussianShare>& x, double part)
{
  // The quantile q of |x|, by bisection: P(|x| > q) = part.
  double low = 0.0, high = 0.0;
  for (const GaussianShare& g : x)
    high = std::max(high, std::abs(g.mean) + 40.0 * g.sigma);
  for (int i = 0; i < 50; ++i) {
    const double q = 0.5 * (low + high);
    double beyond = 0.0;
    for (const GaussianShare& g : x)
      beyond += g.share * outsideProbability(g.mean, g.sigma, q);
    (beyond > part ? low : high) = q;
  }
  // q and what |x| is beyond it: (|x| - q)+ in the mean, over the part.
  const double q = 0.5 * (low + high);
  double excess = 0.0;
  for (const GaussianShare& g : x) {
    const double m = std::abs(g.mean), s = std::max(g.sigma, kKnown * q);
    if (s <= 0.0)
      continue;
    const double above = (q - m) / s, below = (q + m) / s;
    excess += g.share * ((m - q) * normalCdf(-above) + s * normalDensity(above) -
                         (m + q) * normalCdf(-below) + s * normalDensity(below));
  }
  return q + excess / part;
}

} // namespace holdfast::contact
