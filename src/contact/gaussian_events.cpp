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

/// Gauss-Hermite rules of up to kMost nodes: E[f(z)], z ~ N(0, 1), is the sum of
/// weights times f at the nodes.
class HermiteRules {
public:
  static constexpr int kMost = 24;

  struct Rule {
    Eigen::VectorXd nodes, weights;
  };

  static const Rule& of(int nodes)
  {
    static const HermiteRules all;
    return all.rules_[static_cast<std::size_t>(nodes)];
  }

private:
  /// From the recursion of the polynomials (Golub and Welsch, Math. Comp. 23, 1969).
  HermiteRules()
  {
    for (int n = 1; n <= kMost; ++n) {
      const Eigen::VectorXd beside =
          Eigen::VectorXd::LinSpaced(n - 1, 1.0, n - 1.0).cwiseSqrt();
      Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver;
      solver.computeFromTridiagonal(Eigen::VectorXd::Zero(n), beside);
      rules_[static_cast<std::size_t>(n)] = {
          solver.eigenvalues(),
          solver.eigenvectors().row(0).cwiseAbs2().transpose()};
    }
  }

  std::array<Rule, kMost + 1> rules_;
};

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

/// E[f(z)], z ~ N(0, 1).
/// \param step of z, over the length in which f rises like Phi.
template <typename Function>
double
normalMean(double step, const Function& f)
{
  // The error for Phi(step z) is less than (step^2 / 2)^nodes.
  constexpr double kError = 1e-9;
  const double nodes = std::log(kError) / std::log(0.5 * step * step);
  if (!(step < 1.0 && nodes <= HermiteRules::kMost))
    return integrate(-kTail, kTail, [&](double z) { return normalDensity(z) * f(z); });
  const HermiteRules::Rule& rule =
      HermiteRules::of(std::max(1, static_cast<int>(std::ceil(nodes))));
  double sum = 0.0;
  for (Eigen::Index i = 0; i < rule.nodes.size(); ++i)
    sum += rule.weights[i] * f(rule.nodes[i]);
  return sum;
}

/// The same as the mean over g: smooth where mu is known worse.
double
slipOverSlope(const Principal& g, const LogFriction& mu)
{
  // Where its density is largest the distribution of mu is steepest.
  const double length = mu.sigma * std::exp(mu.mean - mu.sigma * mu.sigma);
  return normalMean(g.sigma[0] / length, [&](double u) {
    const double x = g.mean[0] + g.sigma[0] * u;
    return normalMean(g.sigma[1] / length, [&](double v) {
      const double y = g.mean[1] + g.sigma[1] * v;
      const double slope = std::max(std::sqrt(x * x + y * y), kKnown);
      return normalCdf((std::log(slope) - mu.mean) / mu.sigma);
    });
  });
}

} // namespace

NormalCdf::NormalCdf()
{
  for (int i = 0; i < kNodes; ++i) {
    const double x = static_cast<double>(i) / kPerUnit - kReach;
    nodes_[static_cast<std::size_t>(i)] = {0.5 * std::erfc(-x / std::sqrt(2.0)),
                                           normalDensity(x) / kPerUnit};
  }
}

const NormalCdf&
NormalCdf::table()
{
  static const NormalCdf table;
  return table;
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
