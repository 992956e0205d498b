/// \file Draws of the error that neighbouring pixels share.
#pragma once

#include <holdfast/correlated_noise.h>

#include <random>
#include <vector>

namespace holdfast {

/// The field s(u) of a noise pattern over the pixels of an image: Gaussian, mean zero,
/// with the covariance of the pattern's components (CorrelatedNoise), at the edges as
/// in the middle. Made once for an image and drawn many times.
///
/// A wave is white noise on a lattice of nodes under a Gaussian of length / sqrt(2),
/// whose autocorrelation is the wave. Nodes are 1 / 1.4 of a length apart wherever the
/// pixels are, and the Gaussian is taken at the pixels themselves: the covariance is
/// right to 2e-4 of the wave's variance at any distance and stride, the variance to
/// rounding. Waves shorter than a quarter of the distance between pixels (correlation
/// of neighbours below 4e-4) are independent from pixel to pixel.
class PatternField {
public:
  /// \param columns_px, rows_px where the image's columns and rows lie in the sensor's
  /// camera, px: 0, 4, 8, ... for every fourth.
  /// \throw std::invalid_argument unless both are finite and increasing.
  PatternField(const CorrelatedNoise& noise,
               const std::vector<double>& columns_px,
               const std::vector<double>& rows_px);

  /// One value per pixel, row by row, in the unit of the pattern's sigmas.
  /// \param field is resized.
  void draw(std::mt19937_64& generator, std::vector<double>& field) const;

private:
  /// What nodes 0, 1, ... give to each position along one axis of the image: the k-th
  /// weight of position i is that of node first[i] + k.
  struct Spread {
    Spread(const std::vector<double>& positions, double length);

    int nodes = 0;
    std::vector<int> first;
    std::vector<double> weights;
  };

  struct Wave {
    double sigma;
    Spread columns;
    Spread rows;
  };

  void add(const Wave& wave,
           std::mt19937_64& generator,
           std::vector<double>& field) const;

  std::size_t width_;
  std::size_t height_;
  double white_sigma_ = 0.0; ///< of waves too short for neighbours to share
  std::vector<Wave> waves_;
};

} // namespace holdfast
