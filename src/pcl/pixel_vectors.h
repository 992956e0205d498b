/// \file What neighbourhoods ask of many pixels, several of them at a time.
#pragma once

#include "reference_surface.h"

#include <array>
#include <cstddef>
#include <cstdint>

namespace holdfast {

/// Floats that may be read, and written, beyond the last pixel of an image or window.
constexpr int kRowPadding = 16;

/// Pixels of one image row, or rows of a window: [begin, end).
struct PixelRange {
  int begin = 0;
  int end = 0;
};

struct PixelWindow {
  PixelRange columns;
  PixelRange rows;
};

/// Values over the pixels of a window; row(v)[u] is that of pixel (u, v). Pixels that
/// are NaN belong to nothing. kRowPadding more may be read after the last.
struct PixelRows {
  const float* first; ///< row(v) = first + v stride; only rows of the window are read
  std::ptrdiff_t stride;

  const float* row(int v) const
  {
    return first + v * stride;
  }
};

/// Slopes of the rays of pixels from that of a seed's: s = (column - u) / fx,
/// t = (row - v) / fy.
struct SeedPixel {
  int u, v;
  double fx, fy;
};

/// The columns of each row of a window whose rays meet the disc.
void discChords(const LateralDisc& disc,
                const SeedPixel& seed,
                const PixelWindow& window,
                PixelRange* chords);

/// A disc on a surface before the pixels that may be of it.
struct DiscOverPixels {
  const LateralDisc& disc;
  SeedPixel seed;
  PixelRows depth; ///< z of pixels, m
  float gate; ///< what is further off the surface is no part of it, 1/m
};

/// Parts of the rows of a window, one for each.
struct PixelChords {
  PixelRange rows;
  const PixelRange* columns; ///< that of row v is columns[v - rows.begin]
};

/// By how much 1/z of the pixels of the chords leaves the disc's surface; NaN where
/// they are no part of it: further off than the gate, or outside the disc.
/// \param departures of row v and column u at departures[v * stride + u].
void surfaceDepartures(const DiscOverPixels& over,
                       const PixelChords& chords,
                       float* departures,
                       std::ptrdiff_t stride);

/// Values of neighbours that belong together differ by less.
struct PixelJump {
  float in_row;
  float across_rows;
};

constexpr int kWordBits = 64;

/// Bits of the pixels of one row, in words, the first in the lowest of the first; zero
/// beyond the last.
struct RowBits {
  std::uint64_t* valid; ///< not NaN
  std::uint64_t* continues; ///< the pixel after it goes on where it is
  std::uint64_t* touches; ///< it goes on where the pixel above is
};

/// Compares neighbours. NaN goes on nowhere.
/// \param above the row before; for the first row, the row itself.
void compareNeighbors(const float* row,
                      const float* above,
                      int count,
                      const PixelJump& jump,
                      const RowBits& bits);

/// Where s^a t^b stands among the monomials, by a + b, then b; how many there are to an
/// order.
constexpr int
monomialIndex(int a, int b)
{
  return (a + b) * (a + b + 1) / 2 + b;
}

constexpr int
numberOfMonomials(int order)
{
  return monomialIndex(0, order) + 1;
}

/// Sums over samples of s^a t^b to twice an order, and of rho s^a t^b to that order, at
/// most the second; rho is 1/z less that of the first sample, s and t are in units of
/// `scale`.
struct SampleSums {
  std::array<double, numberOfMonomials(4)> powers;
  std::array<double, numberOfMonomials(2)> with_rho;
};

SampleSums sumSamples(const RaySamples& samples, int order, double scale);

} // namespace holdfast
