/// \file Probabilities of Gaussian numbers, as contact risk needs them (FUSION 6).
#pragma once

#include <holdfast/contact/foot.h>

#include <Eigen/Core>

#include <array>
#include <cstddef>
#include <vector>

namespace holdfast::contact {

/// Phi(x) by cubic Hermite interpolation over [-kReach, kReach], since a foothold takes
/// thousands: its error is at most step^4 / 384 times the largest fourth derivative,
/// 1.4: 6e-8.
class NormalCdf {
public:
  static const NormalCdf& table();

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
  static constexpr int kPerUnit = 16, kReach = 8, kNodes = 2 * kReach * kPerUnit + 1;

  struct Node {
    double value, slope;
  };

  NormalCdf();

  std::array<Node, kNodes> nodes_;
};

inline double
normalCdf(double x)
{
  return NormalCdf::table().at(x);
}

/// phi(x).
double normalDensity(double x);

/// P(|x| > limit), x ~ N(mean, sigma^2); sigma may be 0.
double outsideProbability(double mean, double sigma, double limit);

/// P(|g| < radius), g ~ N(mean, covariance).
double discProbability(const Eigen::Vector2d& mean,
                       const Eigen::Matrix2d& covariance,
                       double radius);

/// Logarithm of a lognormal friction: its mean and standard deviation.
struct LogFriction {
  explicit LogFriction(const Friction& friction);
  double mean, sigma;
};

/// P(|g| > mu), mu lognormal and independent of g.
double slipProbability(const Eigen::Vector2d& mean,
                       const Eigen::Matrix2d& covariance,
                       const Friction& friction);

/// One of several Gaussians, and how likely it is that one.
struct GaussianShare {
  double share, mean, sigma;
};

/// Mean of the worst part of |x|, of which that is the probability.
double tailMean(const std::vector<GaussianShare>& x, double part);

} // namespace holdfast::contact
