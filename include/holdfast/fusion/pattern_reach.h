/// \file What of a camera's fixed pattern is left when a spot is seen through other
/// pixels.
#pragma once

#include <holdfast/correlated_noise.h>

#include <Eigen/Core>

#include <vector>

namespace holdfast {

/// A Gaussian wave of the pattern over the view.
struct PatternReach {
  double variance = 1.0; ///< in any unit: only its share of all waves counts
  double length = 0.0; ///< as a tangent: in pixels over the focal length
};

/// The waves of a pattern as a camera of this focal length has them.
std::vector<PatternReach> patternReach(const CorrelatedNoise& noise, double focal_px);

/// One wave, where no more is known than how far the pattern reaches.
std::vector<PatternReach> singleWave(double length);

/// Correlation of what the pattern does to a patch, before and after it has moved over
/// the view: of its height, its slopes, and its curvatures.
///
/// Averaged over a support that is Gaussian with standard deviation s, a wave of length
/// l has the variance l^2/L^2 and the correlation exp(-D^2 / 2 L^2), L^2 = l^2 + 2 s^2:
/// short waves average out over the support, and what is left of them decays with the
/// support's size, not with their own. A coefficient of order n of the fit over it has
/// a variance (s^2/L^2)^n times that (Mehler's formula), and a correlation with zeros,
/// at which it counts as lost.
/// \param support s, as a tangent
/// \param moved D, as a tangent
Eigen::Vector3d patternCorrelation(const std::vector<PatternReach>& waves,
                                   double support,
                                   double moved);

} // namespace holdfast
