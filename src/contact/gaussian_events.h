/// \file Probabilities of Gaussian numbers, as contact risk needs them (FUSION 6).
#pragma once

#include <holdfast/contact/foot.h>

#include <Eigen/Core>

#include <vector>

namespace holdfast::contact {

/// Phi(x), to 1e-7; from a table, since a foothold takes a thousand of them.
double normalCdf(double x);

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
