/// \file Gaussian random fields with the covariance of a noise pattern, exactly.
#pragma once

#include "random.h"

#include <holdfast/noise_pattern.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstddef>
#include <utility>
#include <vector>

namespace holdfast::test {

/// Draws fields by circulant embedding (Dietrich and Newsam, "Fast and exact simulation
/// of stationary Gaussian processes through circulant embedding of the covariance
/// matrix", SIAM Journal on Scientific Computing 18, 1997): on a torus the covariance
/// is diagonal in Fourier space. What is drawn is far from the seam.
class CorrelatedField {
public:
  /// \param margin px, beyond which the pattern's covariance is as good as zero.
  CorrelatedField(const NoisePattern& pattern, int width, int height, int margin)
  : width_(width)
  , height_(height)
  , columns_(powerOfTwo(width + margin))
  , rows_(powerOfTwo(height + margin))
  , roots_(columns_ * rows_)
  {
    for (std::size_t v = 0; v < rows_; ++v)
      for (std::size_t u = 0; u < columns_; ++u)
        roots_[v * columns_ + u] = pattern.covariance(
            std::hypot(std::min(u, columns_ - u), std::min(v, rows_ - v)));
    transform(roots_);
    // Below zero by what the covariance still is at the seam.
    for (std::complex<double>& value : roots_)
      value = std::sqrt(std::max(0.0, value.real()) /
                        static_cast<double>(columns_ * rows_));
  }

  /// One value per pixel, row by row.
  std::vector<double> draw(Random& random) const
  {
    std::vector<std::complex<double>> waves(roots_.size());
    for (std::size_t i = 0; i < waves.size(); ++i) {
      const double real = random.normal();
      waves[i] = roots_[i] * std::complex<double>(real, random.normal());
    }
    transform(waves);
    std::vector<double> field;
    for (int v = 0; v < height_; ++v)
      for (int u = 0; u < width_; ++u)
        field.push_back(
            waves[static_cast<std::size_t>(v) * columns_ + static_cast<std::size_t>(u)]
                .real());
    return field;
  }

private:
  static std::size_t powerOfTwo(int least)
  {
    std::size_t n = 1;
    while (n < static_cast<std::size_t>(least))
      n *= 2;
    return n;
  }

  /// Cooley and Tukey's transform of n numbers, in place.
  static void transform(std::complex<double>* x, std::size_t n)
  {
    for (std::size_t i = 1, j = 0; i < n; ++i) {
      std::size_t bit = n / 2;
      for (; (j & bit) != 0; bit /= 2)
        j ^= bit;
      j ^= bit;
      if (i < j)
        std::swap(x[i], x[j]);
    }
    for (std::size_t length = 2; length <= n; length *= 2) {
      std::vector<std::complex<double>> factors;
      for (std::size_t k = 0; k < length / 2; ++k)
        factors.push_back(std::polar(1.0,
                                     -2.0 * std::acos(-1.0) * static_cast<double>(k) /
                                         static_cast<double>(length)));
      for (std::size_t i = 0; i < n; i += length)
        for (std::size_t k = 0; k < length / 2; ++k) {
          const std::complex<double> a = x[i + k], w = factors[k];
          const std::complex<double> c = x[i + k + length / 2];
          // Written out: the operator looks for infinities.
          const std::complex<double> b(c.real() * w.real() - c.imag() * w.imag(),
                                       c.real() * w.imag() + c.imag() * w.real());
          x[i + k] = a + b;
          x[i + k + length / 2] = a - b;
        }
    }
  }

  void transform(std::vector<std::complex<double>>& image) const
  {
    for (std::size_t v = 0; v < rows_; ++v)
      transform(&image[v * columns_], columns_);
    std::vector<std::complex<double>> column(rows_);
    for (std::size_t u = 0; u < columns_; ++u) {
      for (std::size_t v = 0; v < rows_; ++v)
        column[v] = image[v * columns_ + u];
      transform(column.data(), rows_);
      for (std::size_t v = 0; v < rows_; ++v)
        image[v * columns_ + u] = column[v];
    }
  }

  int width_;
  int height_;
  std::size_t columns_;
  std::size_t rows_;
  std::vector<std::complex<double>> roots_; ///< of the eigenvalues
};

} // namespace holdfast::test
