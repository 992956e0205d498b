#include "pattern.h"

#include <holdfast/geometry/constants.h>

#include "surface_fit.h"

#include "parallel/thread_memory.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

namespace holdfast {
namespace {

using kernel::kCells, kernel::kCellRow;
using Sum = Eigen::Matrix<double, kCellRow, kCellRow>; // symmetric

// A wave shorter than this many sides of a cell changes too much within one.
constexpr double kShortWaveInCells = 0.5;

// sum of exp(-D^2 / (2 length^2)) over the other points of a square lattice: the square
// of that along a line, less the point itself.
double
neighborSum(double length, double spacing)
{
  constexpr double kRootOfTwoPi = 2.5066282746310002;
  const double t = spacing / length;
  // The integral where it is within 1e-4 of the sum, else the sum's first terms.
  const double line = t < 1.4 ?
                          kRootOfTwoPi / t :
                          1.0 + 2.0 * (std::exp(-0.5 * t * t) + std::exp(-2.0 * t * t));
  return line * line - 1.0;
}

// Half of E|x| over a Gaussian, in its lengths: by how far the lack of neighbours at an
// edge reaches inwards, 1/sqrt(2 pi).
constexpr double kReachOfEdge = 0.3989422804014327;

// At the edge a point has half of its neighbours, this many reaches inside all of them:
// as much less in the mean as a half-plane lacks.
constexpr double kEdgeInReaches = 6.0;

// The mean of exp(-(x - x')^2 / (2 length^2)) over x and x' in intervals of length
// `side`, whose middles are no, one, two and more sides apart; their difference, which
// is triangular, as a Gaussian of the same variance.
class CellMeans {
public:
  CellMeans(double length, double side)
  : spread_(length * length + side * side / 6.0)
  , side_(side)
  , within_(length / std::sqrt(spread_))
  {}

  /// In one and the same interval.
  double within() const
  {
    return within_;
  }

  void write(double means[kCells]) const
  {
    double mean = within_, ratio = std::exp(-0.5 * side_ * side_ / spread_);
    const double change = ratio * ratio;
    for (int apart = 0; apart < kCells; ++apart) {
      means[apart] = mean;
      mean *= ratio; // exponents go by squares: 0, 1, 4, 9
      ratio *= change;
    }
  }

private:
  double spread_, side_, within_;
};

kernel::Points
withPattern(const PointBatch& batch, const kernel::PatternPoints& shared)
{
  kernel::Points points = kernelPoints(batch);
  points.pattern = &shared;
  return points;
}

} // namespace

PatternSupport::PatternSupport(PointBatch& batch)
{
  const int n = batch.size();
  const kernel::PatternPoints shared = kernelPattern(batch);
  const kernel::Points points = withPattern(batch, shared);
  const double near[2] = {shared.pixel[0][0], shared.pixel[1][0]}; // to lose no digits
  kernel::PixelSums sums;
  kernel::kernel().accumulatePixels(points, near, sums);
  const double u = sums.sum[0] / n, v = sums.sum[1] / n;
  mean_ << near[0] + u, near[1] + v;
  // A pixel is a square of side one, which also keeps rows of points from vanishing.
  constexpr double kPixelVariance = 1.0 / 12.0;
  Eigen::Matrix2d M;
  M(0, 0) = sums.squares[0] / n - u * u + kPixelVariance;
  M(0, 1) = M(1, 0) = sums.squares[1] / n - u * v;
  M(1, 1) = sums.squares[2] / n - v * v + kPixelVariance;
  // The second moments of a uniform ellipse are a quarter of its semi-axes squared.
  const double root = std::sqrt(std::max(M.determinant(), 0.0));
  radius_px_ = 2.0 * std::sqrt(root);
  spacing_px_ = radius_px_ * std::sqrt(kPi / n);
  // Every point stands for a square about it.
  const double extent =
      std::max(sums.high[0] - sums.low[0], sums.high[1] - sums.low[1]) + spacing_px_;
  u0_ = 0.5 * (sums.low[0] + sums.high[0] - extent);
  v0_ = 0.5 * (sums.low[1] + sums.high[1] - extent);
  side_px_ = extent / kCells;
  to_disc_ = Eigen::Matrix2d(M.llt().matrixL()).inverse() * 0.5;
  writeExtra(points, batch);
}

bool
PatternSupport::isShort(const CorrelatedNoise::Component& wave) const
{
  return wave.length_px < kShortWaveInCells * side_px_;
}

void
PatternSupport::writeExtra(const kernel::Points& points, PointBatch& batch) const
{
  double neighbors = 0.0, reach = 0.0, within_cell = 0.0;
  for (const CorrelatedNoise::Component& wave : batch.pattern()->components()) {
    if (isShort(wave)) {
      const double sum = wave.variance * neighborSum(wave.length_px, spacing_px_);
      neighbors += sum;
      reach += sum * kReachOfEdge * wave.length_px;
    }
    else {
      // The sum over pairs of cells holds every point with itself, as if it were
      // anywhere in the cell.
      const double mean = CellMeans(wave.length_px, side_px_).within();
      within_cell += wave.variance * mean * mean;
    }
  }
  reach /= std::max(neighbors, std::numeric_limits<double>::min());
  kernel::kernel().neighborVariances(points,
                                     {{mean_[0], mean_[1]},
                                      {to_disc_(0, 0), to_disc_(1, 0), to_disc_(1, 1)},
                                      neighbors,
                                      within_cell,
                                      kEdgeInReaches * reach / radius_px_},
                                     batch.channel(PointBatch::EXTRA));
}

void
PatternSupport::writeCovariance(const CorrelatedNoise& noise,
                                kernel::CellSums& cells) const
{
  struct Wave {
    double variance, means[kCells];
  };
  // Kept between patches: no allocation once they have seen the most.
  auto& waves = threadMemory<std::vector<Wave>, struct Waves>();
  waves.resize(noise.components().size());
  std::size_t count = 0;
  for (const CorrelatedNoise::Component& component : noise.components())
    if (!isShort(component)) {
      Wave& wave = waves[count++];
      wave.variance = component.variance;
      CellMeans(component.length_px, side_px_).write(wave.means);
    }
  waves.resize(count);
  for (int down = 0; down < kCells; ++down) {
    double sum[kCells] = {};
    for (const Wave& wave : waves) {
      const double along = wave.variance * wave.means[down];
      for (int across = 0; across < kCells; ++across)
        sum[across] += along * wave.means[across];
    }
    std::copy_n(sum, kCells, cells.covariance[down]);
  }
}

PatternMatrix
PatternSupport::sum(const CorrelatedNoise& noise,
                    kernel::Precision precision,
                    kernel::CellSums& cells) const
{
  writeCovariance(noise, cells);
  alignas(64) Sum sum;
  kernel::kernel().sumOverCells(precision, cells, sum.data());
  return sum.topLeftCorner<kPatternTerms, kPatternTerms>();
}

} // namespace holdfast
