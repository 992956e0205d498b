#include "wave_fit.h"

#include <Eigen/Cholesky>

#include <cmath>
#include <cstdlib>
#include <limits>
#include <numeric>
#include <utility>

namespace holdfast {
namespace {

// Shorter waves are white to every pair of pixels.
constexpr double kShortestLength = 0.4; // px
// Two waves of more similar lengths than this factor are one.
constexpr double kLeastRatio = 2.0;

constexpr int kGrid = 20; // lengths on the grid of the first search
constexpr double kFirstStep = 0.1; // of the search in the logarithms of lengths
constexpr double kLastStep = 1e-5;

using Columns = std::vector<Eigen::ArrayXd>; // white part first; at most three

/// The best of all ways to leave out columns for which no coefficient is negative.
void
solveNotNegative(const PatternData& data, const Columns& columns, WaveFit& fit)
{
  const auto count = static_cast<Eigen::Index>(columns.size());
  Eigen::Matrix3d A = Eigen::Matrix3d::Identity();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  for (Eigen::Index k = 0; k < count; ++k) {
    const Eigen::ArrayXd weighted = columns[static_cast<std::size_t>(k)] * data.weights;
    b[k] = (weighted * data.values).sum();
    for (Eigen::Index l = 0; l < count; ++l)
      A(k, l) = (weighted * columns[static_cast<std::size_t>(l)]).sum();
  }
  const double whole = (data.weights * data.values.square()).sum();
  Eigen::Vector3d best = Eigen::Vector3d::Zero();
  fit.error = whole;
  for (unsigned used = 1; used < 1U << columns.size(); ++used) {
    Eigen::Matrix3d part = A;
    Eigen::Vector3d right = b;
    for (Eigen::Index k = 0; k < 3; ++k)
      if ((used >> k & 1U) == 0U) {
        part.row(k).setZero();
        part.col(k).setZero();
        part(k, k) = 1.0;
        right[k] = 0.0;
      }
    const Eigen::Vector3d x = part.ldlt().solve(right);
    const double error = whole - 2.0 * x.dot(b) + x.dot(A * x);
    if (x.allFinite() && x.minCoeff() >= 0.0 && error < fit.error) {
      fit.error = error;
      best = x;
    }
  }
  fit.white = best[0];
  fit.variances.assign(best.data() + 1, best.data() + count);
}

bool
isAllowed(const std::vector<double>& log_lengths)
{
  double least = std::log(kShortestLength);
  for (const double length : log_lengths) {
    if (length < least || length > std::log(kLongestWave))
      return false;
    least = length + std::log(kLeastRatio);
  }
  return true;
}

/// The best for these lengths if that is better than the best so far.
bool
improve(const PatternDesign& design,
        const PatternData& data,
        const std::vector<double>& log_lengths,
        WaveFit& best)
{
  if (!isAllowed(log_lengths))
    return false;
  WaveFit tried = fitVariances(design, data, best.shapes, log_lengths);
  // Not by rounding alone, or the search would not end.
  if (!(tried.error < best.error * (1.0 - 1e-12)))
    return false;
  best = std::move(tried);
  return true;
}

/// Calls use(offsets) for all vectors of so many numbers from 0 to base - 1.
template <typename Use>
void
forEachDigits(std::size_t count, int base, Use&& use)
{
  std::vector<int> digits(count, 0);
  for (;;) {
    use(digits);
    std::size_t k = 0;
    while (k < count && ++digits[k] == base)
      digits[k++] = 0;
    if (k == count)
      return;
  }
}

/// Steps along each length and along all together as long as one is better, then
/// smaller steps.
WaveFit
searchFrom(const PatternDesign& design, const PatternData& data, WaveFit best)
{
  for (double step = kFirstStep; step > kLastStep; step *= 0.5)
    for (bool moved = true; moved;) {
      moved = false;
      const std::vector<double> middle = best.log_lengths;
      forEachDigits(middle.size(), 3, [&](const std::vector<int>& digits) {
        std::vector<double> lengths = middle;
        for (std::size_t m = 0; m < lengths.size(); ++m)
          lengths[m] += (digits[m] - 1) * step;
        moved |= improve(design, data, lengths, best);
      });
    }
  return best;
}

/// Covariance of the means of two blocks. But for the same and the next ones it is that
/// of their middles.
double
blockCovariance(PatternShape shape, double distance, double length)
{
  if (distance >= 2.0 * kBlockSize)
    return correlation(shape, distance / length);
  // Offsets between pixels of the two have a triangular distribution; short waves need
  // all of them, and these matter in the same block only.
  const int step = distance == 0.0 ? 1 : 4;
  double sum = 0.0, weights = 0.0;
  for (int v = 1 - kBlockSize + step / 2; v < kBlockSize; v += step)
    for (int u = 1 - kBlockSize + step / 2; u < kBlockSize; u += step) {
      const double weight = (kBlockSize - std::abs(u)) * (kBlockSize - std::abs(v));
      sum += weight * correlation(shape, std::hypot(distance + u, v) / length);
      weights += weight;
    }
  return sum / weights;
}

} // namespace

PatternDesign::PatternDesign(Eigen::ArrayXd differences, const BlockCorrelogram& blocks)
: differences_(std::move(differences)), distances_(blocks.distances), K_(blocks.K)
{}

Eigen::Index
PatternDesign::rows() const
{
  return differences_.size() + K_.rows();
}

Eigen::ArrayXd
PatternDesign::white() const
{
  Eigen::ArrayXd column(rows());
  column << Eigen::ArrayXd::Ones(differences_.size()),
      K_.col(0).array() / (kBlockSize * kBlockSize);
  return column;
}

Eigen::ArrayXd
PatternDesign::wave(PatternShape shape, double length) const
{
  Eigen::ArrayXd column(rows());
  for (Eigen::Index a = 0; a < differences_.size(); ++a) {
    const double t = differences_[a] / length;
    column[a] = 1.0 - (4.0 * correlation(shape, t) - correlation(shape, 2.0 * t)) / 3.0;
  }
  Eigen::VectorXd covariances(distances_.size());
  for (Eigen::Index k = 0; k < covariances.size(); ++k)
    covariances[k] = blockCovariance(shape, distances_[k], length);
  column.tail(K_.rows()) = K_ * covariances;
  return column;
}

double
WaveFit::single() const
{
  return std::accumulate(variances.begin(), variances.end(), white);
}

Eigen::ArrayXd
WaveFit::expected(const PatternDesign& design) const
{
  Eigen::ArrayXd sum = white * design.white();
  for (std::size_t m = 0; m < variances.size(); ++m)
    sum += variances[m] * design.wave(shapes[m], std::exp(log_lengths[m]));
  return sum;
}

WaveFit
fitVariances(const PatternDesign& design,
             const PatternData& data,
             const std::vector<PatternShape>& shapes,
             const std::vector<double>& log_lengths)
{
  WaveFit fit;
  fit.shapes = shapes;
  fit.log_lengths = log_lengths;
  Columns columns{design.white()};
  for (std::size_t m = 0; m < shapes.size(); ++m)
    columns.push_back(design.wave(shapes[m], std::exp(log_lengths[m])));
  solveNotNegative(data, columns, fit);
  return fit;
}

WaveFit
fitWaves(const PatternDesign& design,
         const PatternData& data,
         const std::vector<PatternShape>& shapes)
{
  const double first = std::log(kShortestLength);
  const double step = (std::log(kLongestWave) - first) / (kGrid - 1);
  WaveFit best;
  best.shapes = shapes;
  best.error = std::numeric_limits<double>::infinity();
  forEachDigits(shapes.size(), kGrid, [&](const std::vector<int>& digits) {
    std::vector<double> lengths;
    for (const int digit : digits)
      lengths.push_back(first + digit * step);
    improve(design, data, lengths, best);
  });
  return searchFrom(design, data, std::move(best));
}

WaveFit
refitWaves(const PatternDesign& design, const PatternData& data, const WaveFit& start)
{
  return searchFrom(design,
                    data,
                    fitVariances(design, data, start.shapes, start.log_lengths));
}

} // namespace holdfast
