#include "pattern.h"

#include "geometry/symmetric.h"
#include "surface_fit.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

namespace holdfast {
namespace {

using kernel::kCells, kernel::kCellRow;
using Sum = Eigen::Matrix<double, kCellRow, kCellRow, Eigen::RowMajor>;

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

// Share of its neighbours that a point has within a support whose edge it is `inside`
// away from: a half at the edge, and as much less than all in the mean as a half-plane
// lacks.
double
shareOfNeighbors(double inside, double reach)
{
  const double lack = std::max(0.0, 1.0 - inside / (6.0 * reach));
  return 1.0 - 0.5 * lack * lack;
}

// The mean of exp(-(x - x')^2 / (2 length^2)) over x and x' in intervals of length
// `side` whose middles are `distance` apart; their difference, which is triangular, as
// a Gaussian of the same variance.
double
meanOverCells(double length, double side, double distance)
{
  const double spread = length * length + side * side / 6.0;
  return length / std::sqrt(spread) * std::exp(-0.5 * distance * distance / spread);
}

// d[gradient | moments in the axes of R, over N] / d[gradient | sums of moments].
PatternMatrix
turnOfMoments(const Eigen::Matrix3d& R, int count)
{
  const double scale = 1.0 / count;
  PatternMatrix turn = PatternMatrix::Identity();
  turn.block<3, 3>(6, 6) = scale * R.transpose();
  for (int e = 0; e < symmetric::kSize; ++e)
    for (int o = 0; o < symmetric::kSize; ++o) {
      const int i = symmetric::kRow[e], j = symmetric::kColumn[e];
      const int b = symmetric::kRow[o], c = symmetric::kColumn[o];
      turn(9 + e, 9 + o) =
          scale * (R(b, i) * R(c, j) + (b == c ? 0.0 : R(c, i) * R(b, j)));
    }
  return turn;
}

// T Q T^T of a T that is the identity, then two blocks.
PatternMatrix
turned(const PatternMatrix& T, const PatternMatrix& Q)
{
  PatternMatrix half = Q, full;
  half.middleRows<3>(6) = T.block<3, 3>(6, 6).lazyProduct(Q.middleRows<3>(6));
  half.middleRows<6>(9) = T.block<6, 6>(9, 9).lazyProduct(Q.middleRows<6>(9));
  full = half;
  full.middleCols<3>(6) =
      half.middleCols<3>(6).lazyProduct(T.block<3, 3>(6, 6).transpose());
  full.middleCols<6>(9) =
      half.middleCols<6>(9).lazyProduct(T.block<6, 6>(9, 9).transpose());
  return full;
}

} // namespace

PatternSupport::PatternSupport(PointBatch& batch)
{
  const double* u = batch.channel(PointBatch::U);
  const double* v = batch.channel(PointBatch::V);
  const int n = batch.size();
  double high_u = -std::numeric_limits<double>::infinity(), high_v = high_u;
  u0_ = v0_ = -high_u;
  double su = 0.0, sv = 0.0, suu = 0.0, suv = 0.0, svv = 0.0;
  const double at_u = u[0], at_v = v[0]; // near the others, to lose no digits
  for (int i = 0; i < n; ++i) {
    const double du = u[i] - at_u, dv = v[i] - at_v;
    u0_ = std::min(u0_, u[i]), high_u = std::max(high_u, u[i]);
    v0_ = std::min(v0_, v[i]), high_v = std::max(high_v, v[i]);
    su += du, sv += dv;
    suu += du * du, suv += du * dv, svv += dv * dv;
  }
  mean_ << at_u + su / n, at_v + sv / n;
  // A pixel is a square of side one, which also keeps rows of points from vanishing.
  constexpr double kPixelVariance = 1.0 / 12.0;
  Eigen::Matrix2d M;
  M << suu / n - su / n * su / n + kPixelVariance, suv / n - su / n * sv / n,
      suv / n - su / n * sv / n, svv / n - sv / n * sv / n + kPixelVariance;
  // The second moments of a uniform ellipse are a quarter of its semi-axes squared.
  constexpr double kPi = 3.14159265358979323846;
  const double root = std::sqrt(std::max(M.determinant(), 0.0));
  radius_px_ = 2.0 * std::sqrt(root);
  spacing_px_ = radius_px_ * std::sqrt(kPi / n);
  // Every point stands for a square about it.
  const double extent = std::max(high_u - u0_, high_v - v0_) + spacing_px_;
  u0_ = 0.5 * (u0_ + high_u - extent);
  v0_ = 0.5 * (v0_ + high_v - extent);
  side_px_ = extent / kCells;
  to_disc_ = Eigen::Matrix2d(M.llt().matrixL()).inverse() * 0.5;
  writeExtra(batch);
}

bool
PatternSupport::isShort(const CorrelatedNoise::Component& wave) const
{
  return wave.length_px < kShortWaveInCells * side_px_;
}

void
PatternSupport::writeExtra(PointBatch& batch) const
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
      const double mean = meanOverCells(wave.length_px, side_px_, 0.0);
      within_cell += wave.variance * mean * mean;
    }
  }
  reach /= std::max(neighbors, std::numeric_limits<double>::min());
  const double* u = batch.channel(PointBatch::U);
  const double* v = batch.channel(PointBatch::V);
  double* extra = batch.channel(PointBatch::EXTRA);
  for (int i = 0; i < batch.size(); ++i) {
    const Eigen::Vector2d on_disc = to_disc_ * (Eigen::Vector2d(u[i], v[i]) - mean_);
    const double inside = std::max(0.0, 1.0 - on_disc.norm()) * radius_px_;
    const double share = reach > 0.0 ? shareOfNeighbors(inside, reach) : 1.0;
    extra[i] = neighbors * share - within_cell;
  }
}

void
PatternSupport::writeCovariance(const CorrelatedNoise& noise,
                                kernel::CellSums& cells) const
{
  for (auto& row : cells.covariance)
    std::fill(std::begin(row), std::end(row), 0.0);
  for (const CorrelatedNoise::Component& wave : noise.components()) {
    if (isShort(wave))
      continue;
    double along[kCells];
    for (int d = 0; d < kCells; ++d)
      along[d] = meanOverCells(wave.length_px, side_px_, d * side_px_);
    for (int down = 0; down < kCells; ++down)
      for (int across = 0; across < kCells; ++across)
        cells.covariance[down][across] += wave.variance * along[down] * along[across];
  }
}

PatternMatrix
PatternSupport::sum(const PointBatch& batch,
                    const Scatter& scatter,
                    const Eigen::Matrix3d& R,
                    const double* response) const
{
  kernel::CellSums cells;
  for (auto& cell : cells.y)
    std::fill(std::begin(cell), std::end(cell), 0.0);
  addResponses(batch, response, cells.y[0]);
  addMoments(batch, scatter.mean, cells.y[0]);
  writeCovariance(*batch.pattern(), cells);
  Sum sum;
  kernel::kernel().sumOverCells(cells, sum.data());
  return turned(turnOfMoments(R, batch.size()),
                sum.topLeftCorner<kPatternTerms, kPatternTerms>());
}

int
PatternSupport::cellOf(double u, double v) const
{
  // Written so that pixels beyond all reason are in some cell, too.
  const auto cell = [this](double distance) {
    const double cells = distance / side_px_;
    return cells > 0.0 ? static_cast<int>(std::min(cells, kCells - 1.0)) : 0;
  };
  return cell(v - v0_) * kCells + cell(u - u0_);
}

void
PatternSupport::addResponses(const PointBatch& batch,
                             const double* response,
                             double* cells) const
{
  const double* u = batch.channel(PointBatch::U);
  const double* v = batch.channel(PointBatch::V);
  const int padded = batch.paddedSize();
  for (int i = 0; i < batch.size(); ++i) {
    double* cell = cells + kCellRow * cellOf(u[i], v[i]);
    for (int a = 0; a < kernel::kMaxTheta; ++a)
      cell[a] += response[a * padded + i];
  }
}

// sum r_i and sum of q_b r_c + q_c r_b, q from the mean; world axes.
void
PatternSupport::addMoments(const PointBatch& batch,
                           const Eigen::Vector3d& mean,
                           double* cells) const
{
  const double* u = batch.channel(PointBatch::U);
  const double* v = batch.channel(PointBatch::V);
  const double* const x[3] = {batch.channel(PointBatch::X),
                              batch.channel(PointBatch::Y),
                              batch.channel(PointBatch::Z)};
  const double* const e[3] = {batch.channel(PointBatch::EX),
                              batch.channel(PointBatch::EY),
                              batch.channel(PointBatch::EZ)};
  for (int i = 0; i < batch.size(); ++i) {
    double* moment = cells + kCellRow * cellOf(u[i], v[i]) + kernel::kMaxTheta;
    const double q[3] = {x[0][i] - mean[0], x[1][i] - mean[1], x[2][i] - mean[2]};
    const double r[3] = {e[0][i], e[1][i], e[2][i]};
    for (int b = 0, entry = 3; b < 3; ++b) {
      moment[b] += r[b];
      for (int c = b; c < 3; ++c, ++entry)
        moment[entry] += q[b] * r[c] + q[c] * r[b];
    }
  }
}

} // namespace holdfast
