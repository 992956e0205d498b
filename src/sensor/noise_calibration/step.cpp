#include "step.h"

#include "jackknife.h"

#include <holdfast/geometry/constants.h>

#include <algorithm>
#include <cmath>
#include <complex>

namespace holdfast {
namespace {

// Between the pixels of a difference, px.
constexpr int kLag = 4;

// Enough for a characteristic function to 0.01, and too few for one.
constexpr std::size_t kMostValues = 5000;
constexpr std::size_t kLeastValues = 100;

// From the lowest point of the characteristic function to its return. Without a step
// there is none; rounding of the depths to millimetres, 1 m away, leaves 0.4 of it.
constexpr double kLeastRise = 0.25;

// More than what a frequency between two of those tried takes from the strength.
constexpr double kClearlyStronger = 0.01;

// Of the differences, which are twice the noise, over the step: finer steps add less
// than 1/192 of the variance of the noise.
constexpr double kMostSteps = 8.0;

// Differences below are none, but for the single precision of the points.
constexpr double kRounding = 1e-6;

/// Multiples of one number, as far as there is one.
struct Comb {
  double frequency = 0.0; ///< the inverse of that number; 0: none
  double resolution = 0.0; ///< of the frequency
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
findComb(const std::vector<double>& values)
{
  Comb comb;
  double squares = 0.0;
  for (const double value : values)
    squares += value * value;
  if (values.size() < kLeastValues)
    return comb;
  const double rms = std::sqrt(squares / static_cast<double>(values.size()));
  // Peaks are as wide as the values are narrow.
  comb.resolution = 0.025 / rms;
  double lowest = 1.0;
  for (double f = comb.resolution; f <= kMostSteps / rms; f += comb.resolution) {
    const double value = characteristic(values, f);
    lowest = std::min(lowest, value);
    if (value > comb.strength && value - lowest >= kLeastRise) {
      comb.frequency = f;
      comb.strength = value;
    }
    // Behind the first peak come its multiples.
    if (comb.frequency > 0.0 && value < 0.5 * (comb.strength + lowest))
      break;
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
/// Differences of zero are a multiple of every step.
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
    if (std::abs(cross) > kRounding * at(0, 0)) // not for NaN
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

/// The frequency of the longest phasor about that of a comb: the disparities themselves
/// span many more steps than their differences and are that much more precise.
double
sharpened(const std::vector<double>& values, const Comb& comb)
{
  const auto [low, high] = std::minmax_element(values.begin(), values.end());
  const double width = 2.0 * comb.resolution;
  const double resolution = std::min(0.1 / (*high - *low), width);
  double best = comb.frequency, longest = 0.0;
  for (double f = best - width; f <= comb.frequency + width; f += resolution) {
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
        const Steps& steps,
        double middle) ///< a disparity; sums about it lose no digits
{
  enum { N, K, KK, D, KD, kSums };
  std::vector<CellSums> cells(kCellColumns * kCellRows,
                              {0.0, Eigen::ArrayXd::Zero(kSums)});
  const double middle_number = steps.numberOf(middle);
  forEachPixel(stack, image, regions, [&](int tile, int frame, int u, int v) {
    const double disparity = stack.disparity(frame, u, v);
    if (!std::isfinite(disparity))
      return;
    const double d = disparity - middle;
    const double k = steps.numberOf(disparity) - middle_number;
    CellSums& cell = cells[static_cast<std::size_t>(image.cellOf(tile))];
    cell.weight += 1.0;
    cell.sums[N] += 1.0;
    cell.sums[K] += k;
    cell.sums[KK] += k * k;
    cell.sums[D] += d;
    cell.sums[KD] += k * d;
  });
  return jackknife(cells, [](const Eigen::ArrayXd& s) {
    return (s[KD] - s[K] * s[D] / s[N]) / (s[KK] - s[K] * s[K] / s[N]);
  });
}

/// Depths rounded to a step of their own look like a comb of disparities near one
/// depth, but farther away, where such steps are less than half as wide, only a comb
/// that is none of their making is still the first.
Comb
findDisparityComb(const DisparityStack& stack,
                  const TileImage& image,
                  const std::vector<Region>& regions,
                  double focal_times_baseline)
{
  const auto itself = [](double d) { return d; };
  const auto depth = [=](double d) { return focal_times_baseline / d; };
  const Comb comb = findComb(crossDifferences(stack, image, regions, itself));
  if (comb.frequency == 0.0)
    return comb;
  const Comb rounding = findComb(crossDifferences(stack, image, regions, depth));
  if (rounding.strength <= comb.strength + kClearlyStronger)
    return comb;
  const double farther_px =
      std::sqrt(0.5 * focal_times_baseline * rounding.frequency / comb.frequency);
  const Comb far = findComb(crossDifferences(stack, image, regions, [&](double d) {
    return d < farther_px ? d : std::nan("");
  }));
  return far.frequency < 1.5 * comb.frequency ? far : Comb{};
}

} // namespace

Estimate
findQuantum(const DisparityStack& stack,
            const TileImage& image,
            const std::vector<Region>& regions,
            double focal_times_baseline)
{
  const Comb comb = findDisparityComb(stack, image, regions, focal_times_baseline);
  if (comb.frequency == 0.0)
    return {};
  std::vector<double> disparities = someDisparities(stack, image, regions);
  Steps steps;
  steps.frequency = sharpened(disparities, comb);
  steps.phase = std::arg(phasor(disparities, steps.frequency)) / (2.0 * kPi);
  const auto half = static_cast<std::ptrdiff_t>(disparities.size() / 2);
  std::nth_element(disparities.begin(), disparities.begin() + half, disparities.end());
  const double median = disparities[static_cast<std::size_t>(half)];
  return regress(stack, image, regions, steps, median);
}

} // namespace holdfast
