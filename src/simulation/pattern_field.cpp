#include <holdfast/simulation/pattern_field.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace holdfast {

namespace {

// With nodes h apart the covariance of a wave swings by 2 exp(-pi^2 length^2 / 2 h^2)
// of itself along an axis, here 1.3e-4.
constexpr double kNodesPerLength = 1.4;
// Six nodes to either side, at least 5 / 1.4 of a length: the rest weighs 3e-6.
constexpr int kTaps = 12;
// In distances between pixels.
constexpr double kShortest = 0.25;

void
requireIncreasing(const std::vector<double>& positions)
{
  const auto is_finite = [](double x) { return std::isfinite(x); };
  // Not to rise is to fall or to stay.
  const auto rises_not = [](double a, double b) { return !(a < b); };
  if (!std::all_of(positions.begin(), positions.end(), is_finite) ||
      std::adjacent_find(positions.begin(), positions.end(), rises_not) !=
          positions.end())
    throw std::invalid_argument(
        "PatternField: columns and rows must be finite and increasing");
}

double
smallestGap(const std::vector<double>& positions)
{
  double gap = std::numeric_limits<double>::infinity();
  for (std::size_t i = 1; i < positions.size(); ++i)
    gap = std::min(gap, positions[i] - positions[i - 1]);
  return gap;
}

} // namespace

PatternField::Spread::Spread(const std::vector<double>& positions, double length)
{
  for (const double position : positions) {
    // In nodes from the one that the first position begins with.
    const double t =
        (position - positions.front()) / length * kNodesPerLength + (kTaps / 2 - 1);
    first.push_back(static_cast<int>(t) - (kTaps / 2 - 1));
    nodes = first.back() + kTaps;
    double taps[kTaps];
    double sum_of_squares = 0.0;
    for (int k = 0; k < kTaps; ++k) {
      const double lengths = (t - (first.back() + k)) / kNodesPerLength;
      taps[k] = std::exp(-lengths * lengths);
      sum_of_squares += taps[k] * taps[k];
    }
    for (const double tap : taps)
      weights.push_back(tap / std::sqrt(sum_of_squares));
  }
}

PatternField::PatternField(const CorrelatedNoise& noise,
                           const std::vector<double>& columns_px,
                           const std::vector<double>& rows_px)
: width_(columns_px.size()), height_(rows_px.size())
{
  requireIncreasing(columns_px);
  requireIncreasing(rows_px);
  const double gap = std::min(smallestGap(columns_px), smallestGap(rows_px));
  double white_variance = 0.0;
  for (const CorrelatedNoise::Component& component : noise.components())
    if (component.length_px < kShortest * gap)
      white_variance += component.variance;
    else if (component.variance > 0.0)
      waves_.push_back({std::sqrt(component.variance),
                        Spread(columns_px, component.length_px),
                        Spread(rows_px, component.length_px)});
  white_sigma_ = std::sqrt(white_variance);
}

void
PatternField::draw(std::mt19937_64& generator, std::vector<double>& field) const
{
  field.assign(width_ * height_, 0.0);
  std::normal_distribution<double> normal;
  if (white_sigma_ > 0.0)
    for (double& value : field)
      value = white_sigma_ * normal(generator);
  for (const Wave& wave : waves_)
    add(wave, generator, field);
}

/// One row of nodes after the other, each spread over the columns first and then over
/// the rows it reaches.
void
PatternField::add(const Wave& wave,
                  std::mt19937_64& generator,
                  std::vector<double>& field) const
{
  std::normal_distribution<double> normal(0.0, wave.sigma);
  std::vector<double> nodes(static_cast<std::size_t>(wave.columns.nodes));
  std::vector<double> row(width_);
  std::size_t begin = 0; // the first row that this and later nodes reach
  for (int node = 0; node < wave.rows.nodes; ++node) {
    while (wave.rows.first[begin] + kTaps <= node)
      ++begin;
    if (wave.rows.first[begin] > node)
      continue;
    for (double& value : nodes)
      value = normal(generator);
    for (std::size_t u = 0; u < width_; ++u) {
      const double* from = nodes.data() + wave.columns.first[u];
      const double* weights = wave.columns.weights.data() + kTaps * u;
      row[u] = 0.0;
      for (int k = 0; k < kTaps; ++k)
        row[u] += weights[k] * from[k];
    }
    for (std::size_t v = begin; v < height_ && wave.rows.first[v] <= node; ++v) {
      const auto tap = static_cast<std::size_t>(node - wave.rows.first[v]);
      const double weight = wave.rows.weights[kTaps * v + tap];
      for (std::size_t u = 0; u < width_; ++u)
        field[width_ * v + u] += weight * row[u];
    }
  }
}

} // namespace holdfast
