#include "noise_calibration_step.h"

#include "noise_calibration_jackknife.h"

#include <holdfast/geometry/constants.h>

#include <algorithm>
#include <cmath>
#include <complex>

namespace holdfast {
namespace {

// Between the pixels of a difference, px.
constexpr int kLag = 4;

// Enough for a characteristic function to about 0.01.
constexpr std::size_t kMostValues = 10000;

// From the lowest point of the characteristic function to its return. Without a step
// there is none; rounding of the depths to millimetres, 1 m away,
// leaves 0.4 of it.
constexpr double kLeastRise = 0.25;

// Strength of a comb that explains all values.
constexpr double kExact = 0.9;

/// Multiples of one number, as far as there is one.
struct Comb {
  double step = 0.0; ///< 0: none
  double strength = 0.0; ///< 1: all of them exactly
};

/// Every n-th of the values added, n such that at most kMostValues remain.
class ThinnedValues {
public:
  void add(double value)
  {
    if (count_++ % stride_ != 0)
      return;
    values_.push_back(value);
    if (values_.size() < kMostValues)
      return;
    for (std::size_t i = 0; 2 * i < values_.size(); ++i)
      values_[i] = values_[2 * i];
    values_.resize((values_.size() + 1) / 2);
    stride_ *= 2;
  }

  const std::vector<double>& values() const
  {
    return values_;
  }

private:
  std::vector<double> values_;
  std::size_t count_ = 0;
  std::size_t stride_ = 1;
};

/// The characteristic function of symmetric values at frequency f.
double
characteristic(const std::vector<double>& values, double frequency)
{
  double sum = 0.0;
  for (const double value : values)
    sum += std::cos(2.0 * kPi * frequency * value);
  return sum / static_cast<double>(values.size());
}

/// Rounding to steps makes the characteristic function periodic (Widrow, "Statistical
/// analysis of amplitude-quantized sampled-data systems", 1961): having fallen, it
/// comes back to 1 at the frequency 1/step. That of noise alone falls and stays down.
Comb
findComb(const std::vector<double>& values, double least_step, double largest_step)
{
  Comb comb;
  double squares = 0.0;
  for (const double value : values)
    squares += value * value;
  if (squares == 0.0)
    return comb;
  // Fine enough for peaks as wide as the values are spread, in 1/40 of their width.
  const double resolution =
      0.025 / std::sqrt(squares / static_cast<double>(values.size()));
  double lowest = 1.0, first = 1.0 / least_step;
  for (double f = 1.0 / largest_step; f <= std::min(1.0 / least_step, 1.4 * first);
       f += resolution) {
    const double value = characteristic(values, f);
    lowest = std::min(lowest, value);
    if (value - lowest < kLeastRise || value <= comb.strength)
      continue;
    // The peak is not far behind the first frequency that is high enough.
    first = std::min(first, f);
    comb = {1.0 / f, value};
  }
  return comb;
}

/// Calls use(tile, frame, u, v) for every pixel of the regions.
template <typename Use>
void
forEachPixel(const DisparityStack& stack,
             const TileImage& image,
             const std::vector<Region>& regions,
             Use&& use)
{
  for (const Region& region : regions)
    for (const int tile : region)
      for (int frame = 0; frame < stack.frames(); ++frame)
        for (int k = 0; k < kTileSize * kTileSize; ++k)
          use(tile,
              frame,
              tile % image.columns * kTileSize + k % kTileSize,
              tile / image.columns * kTileSize + k / kTileSize);
}

/// Differences of differences, d00 - d10 - d01 + d11, at the corners of squares within
/// tiles: integer combinations keep to the steps, and the slope of a plane drops out.
/// \param value maps a disparity to what is compared.
template <typename Value>
std::vector<double>
crossDifferences(const DisparityStack& stack,
                 const TileImage& image,
                 const std::vector<Region>& regions,
                 Value&& value)
{
  ThinnedValues differences;
  forEachPixel(stack, image, regions, [&](int, int frame, int u, int v) {
    if (u % kTileSize + kLag >= kTileSize || v % kTileSize + kLag >= kTileSize)
      return;
    const auto at = [&](int du, int dv) {
      return value(static_cast<double>(stack.disparity(frame, u + du, v + dv)));
    };
    const double cross = at(0, 0) - at(kLag, 0) - at(0, kLag) + at(kLag, kLag);
    if (std::isfinite(cross))
      differences.add(cross);
  });
  return differences.values();
}

std::vector<double>
someDisparities(const DisparityStack& stack,
                const TileImage& image,
                const std::vector<Region>& regions)
{
  ThinnedValues disparities;
  forEachPixel(stack, image, regions, [&](int, int frame, int u, int v) {
    if (const double d = stack.disparity(frame, u, v); std::isfinite(d))
      disparities.add(d);
  });
  return disparities.values();
}

/// sum exp(2 pi i f d): the longer, the better d keeps to steps of 1/f. Its angle tells
/// where the steps begin.
std::complex<double>
phasor(const std::vector<double>& values, double frequency)
{
  std::complex<double> sum = 0.0;
  for (const double value : values)
    sum += std::polar(1.0, 2.0 * kPi * frequency * value);
  return sum;
}

/// The frequency of the longest phasor near the one given: the disparities themselves
/// span many more steps than their differences and are that much more precise.
double
sharpened(const std::vector<double>& values, double frequency)
{
  const auto [low, high] = std::minmax_element(values.begin(), values.end());
  const double resolution = 0.1 / std::max(*high - *low, 1.0);
  double best = frequency, longest = 0.0;
  for (double f = 0.9 * frequency; f <= 1.1 * frequency; f += resolution) {
    const double length = std::abs(phasor(values, f));
    if (length > longest) {
      longest = length;
      best = f;
    }
  }
  return best;
}

/// The disparities that keep to steps: d = (k + phase) / frequency.
struct Steps {
  double frequency; ///< 1/px
  double phase;

  double numberOf(double disparity) const
  {
    return std::round(disparity * frequency - phase);
  }
};

/// Slope of the disparities over the numbers of their steps, by linear regression.
Estimate
regress(const DisparityStack& stack,
        const TileImage& image,
        const std::vector<Region>& regions,
        const std::vector<int>& cells,
        const Steps& steps,
        double middle) ///< a disparity; sums about it lose no digits
{
  enum { N, K, KK, D, KD, kSums };
  std::vector<CellSums> sums(
      1 + static_cast<std::size_t>(*std::max_element(cells.begin(), cells.end())),
      {0.0, Eigen::ArrayXd::Zero(kSums)});
  const double middle_number = steps.numberOf(middle);
  forEachPixel(stack, image, regions, [&](int tile, int frame, int u, int v) {
    const double disparity = stack.disparity(frame, u, v);
    if (!std::isfinite(disparity))
      return;
    const double d = disparity - middle;
    const double k = steps.numberOf(disparity) - middle_number;
    const int index = cells[static_cast<std::size_t>(tile)];
    CellSums& cell = sums[static_cast<std::size_t>(index)];
    cell.weight += 1.0;
    cell.sums[N] += 1.0;
    cell.sums[K] += k;
    cell.sums[KK] += k * k;
    cell.sums[D] += d;
    cell.sums[KD] += k * d;
  });
  return jackknife(sums, [](const Eigen::ArrayXd& s) {
    return (s[KD] - s[K] * s[D] / s[N]) / (s[KK] - s[K] * s[K] / s[N]);
  });
}

} // namespace

Estimate
findQuantum(const DisparityStack& stack,
            const TileImage& image,
            const std::vector<Region>& regions,
            const std::vector<int>& cells,
            double focal_times_baseline)
{
  constexpr double kLeastPx = 1.0 / 64.0, kLargestPx = 1.0;
  const auto itself = [](double d) { return d; };
  const auto depth = [=](double d) { return focal_times_baseline / d; };
  const Comb comb =
      findComb(crossDifferences(stack, image, regions, itself), kLeastPx, kLargestPx);
  if (comb.step == 0.0)
    return {};

  std::vector<double> disparities = someDisparities(stack, image, regions);
  Steps steps;
  steps.frequency = sharpened(disparities, 1.0 / comb.step);
  steps.phase = std::arg(phasor(disparities, steps.frequency)) / (2.0 * kPi);
  const auto half = static_cast<std::ptrdiff_t>(disparities.size() / 2);
  std::nth_element(disparities.begin(), disparities.begin() + half, disparities.end());
  const double median = disparities[static_cast<std::size_t>(half)];

  // Depths rounded to a step of their own look like that near one depth, and so do
  // steps of disparity in the depths, but only one of them is exact.
  const double step_m = focal_times_baseline / (median * median) / steps.frequency;
  const Comb rounding = findComb(crossDifferences(stack, image, regions, depth),
                                 0.67 * step_m,
                                 10.0 * step_m);
  if (rounding.strength > std::max(kExact, comb.strength))
    return {};
  return regress(stack, image, regions, cells, steps, median);
}

} // namespace holdfast
