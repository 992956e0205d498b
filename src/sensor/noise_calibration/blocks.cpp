#include "blocks.h"

#include <Eigen/QR>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

namespace holdfast {
namespace {

// Of a plane, so that its three parameters take only part of the variance.
constexpr std::size_t kLeastBlocks = 12;

// Distances in K are rounded to this part of a block.
constexpr int kPartsOfBlock = 8;
constexpr int kDistances = 200 * kPartsOfBlock; // those of larger images are the last

struct Block {
  int column = 0;
  int row = 0;
  int cell = 0;
  double disparity = 0.0; ///< later: what is left of it
  Eigen::Vector3d basis; ///< row of an orthonormal basis B of all planes; P = B B^T
};

/// Blocks all of whose tiles lie on the plane.
std::vector<Block>
blocksOf(const TileImage& tiles, const Region& plane)
{
  std::map<std::pair<int, int>, std::pair<PlaneMoments, int>> moments;
  for (const int i : plane) {
    const std::pair<int, int> place{i / tiles.columns / 2, i % tiles.columns / 2};
    auto& [sum, count] = moments[place];
    sum += tiles[i].mean;
    ++count;
  }
  std::vector<Block> blocks;
  for (const auto& [place, entry] : moments) {
    if (entry.second < 4)
      continue;
    Block& block = blocks.emplace_back();
    block.row = place.first;
    block.column = place.second;
    block.cell = tiles.patternCellOf(tiles.index(2 * block.column, 2 * block.row));
    block.disparity = entry.first.mean.z();
    block.basis << 1.0, entry.first.mean.head<2>();
  }
  return blocks;
}

/// Leaves the residuals, and the basis orthonormal. False when the blocks span no
/// plane.
bool
subtractPlane(std::vector<Block>& blocks)
{
  const auto n = static_cast<Eigen::Index>(blocks.size());
  Eigen::MatrixXd basis(n, 3);
  Eigen::VectorXd disparities(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    basis.row(i) = blocks[static_cast<std::size_t>(i)].basis;
    disparities[i] = blocks[static_cast<std::size_t>(i)].disparity;
  }
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(basis);
  if (qr.rank() < 3)
    return false;
  const Eigen::MatrixXd Q = qr.householderQ() * Eigen::MatrixXd::Identity(n, 3);
  const Eigen::VectorXd residuals = disparities - Q * (Q.transpose() * disparities);
  for (Eigen::Index i = 0; i < n; ++i) {
    blocks[static_cast<std::size_t>(i)].basis = Q.row(i);
    blocks[static_cast<std::size_t>(i)].disparity = residuals[i];
  }
  return true;
}

/// Distance in whole blocks.
double
blocksBetween(const Block& a, const Block& b)
{
  return std::hypot(a.column - b.column, a.row - b.row);
}

/// From 0; kBlockBins or more, and -1 for the block itself: none.
int
binOf(double blocks)
{
  return static_cast<int>(std::lround(blocks)) - 1;
}

Eigen::Index
columnOf(double blocks)
{
  return std::min<Eigen::Index>(std::lround(kPartsOfBlock * blocks), kDistances - 1);
}

void
addProducts(const std::vector<Block>& blocks, BlockCorrelogram& sums)
{
  for (const Block& a : blocks)
    for (const Block& b : blocks) {
      const double distance = blocksBetween(a, b);
      const int bin = binOf(distance);
      if (bin < 0 || bin >= kBlockBins)
        continue;
      // Every pair comes in both orders: half of it counts for the cell of either.
      Eigen::ArrayXd& cell = sums.cells[static_cast<std::size_t>(a.cell)].sums;
      cell[bin * kBlockSums + BlockProducts] += a.disparity * b.disparity;
      cell[bin * kBlockSums + BlockPairs] += 1.0;
      sums.bin_distances[bin] += kBlockSize * distance;
    }
}

/// (I - P) A_a (I - P) = A_a - P A_a - A_a P + P A_a P, its elements summed by
/// distance, with the rows of F_a = A_a B, and E_d(j) the sum of the basis over the
/// blocks at distance d of block j.
void
addOutline(const std::vector<Block>& blocks, BlockCorrelogram& sums)
{
  using Rows = Eigen::Matrix<double, Eigen::Dynamic, 3>;
  const Eigen::Index columns = sums.K.cols();
  std::vector<Eigen::Matrix3d> BF(kBlockBins, Eigen::Matrix3d::Zero());
  Eigen::Matrix<double, Eigen::Dynamic, 9> S =
      Eigen::Matrix<double, Eigen::Dynamic, 9>::Zero(columns, 9);
  for (const Block& j : blocks) {
    Rows E = Rows::Zero(columns, 3), F = Rows::Zero(kBlockBins, 3);
    for (const Block& l : blocks) {
      const double distance = blocksBetween(j, l);
      const int bin = binOf(distance);
      E.row(columnOf(distance)) += l.basis;
      if (bin < 0 || bin >= kBlockBins)
        continue;
      F.row(bin) += l.basis;
      sums.K(bin, columnOf(distance)) += 1.0;
    }
    sums.K.noalias() -= 2.0 * F * E.transpose();
    for (int a = 0; a < kBlockBins; ++a)
      BF[static_cast<std::size_t>(a)] += j.basis * F.row(a);
    for (int k = 0; k < 3; ++k)
      S.middleCols<3>(3 * k) += E * j.basis[k];
  }
  for (int a = 0; a < kBlockBins; ++a)
    sums.K.row(a) += S * BF[static_cast<std::size_t>(a)].reshaped();
}

} // namespace

BlockCorrelogramBuilder::BlockCorrelogramBuilder()
{
  sums_.cells.assign(kPatternColumns * kPatternRows,
                     {0.0, Eigen::ArrayXd::Zero(kBlockBins * kBlockSums)});
  sums_.distances = Eigen::ArrayXd::LinSpaced(kDistances, 0.0, kDistances - 1.0) *
                    kBlockSize / kPartsOfBlock;
  sums_.K = Eigen::MatrixXd::Zero(kBlockBins, kDistances);
  sums_.bin_distances = Eigen::ArrayXd::Zero(kBlockBins);
}

void
BlockCorrelogramBuilder::add(const TileImage& tiles, const Region& plane)
{
  std::vector<Block> blocks = blocksOf(tiles, plane);
  if (blocks.size() < kLeastBlocks || !subtractPlane(blocks))
    return;
  addProducts(blocks, sums_);
  addOutline(blocks, sums_);
}

BlockCorrelogram
BlockCorrelogramBuilder::finish() const
{
  BlockCorrelogram result = sums_;
  Eigen::ArrayXd pairs = Eigen::ArrayXd::Zero(kBlockBins);
  for (const CellSums& cell : sums_.cells)
    for (int a = 0; a < kBlockBins; ++a)
      pairs[a] += cell.sums[a * kBlockSums + BlockPairs];
  pairs = (pairs > 0.0).select(pairs, 1.0);
  result.bin_distances /= pairs;
  for (int a = 0; a < kBlockBins; ++a)
    result.K.row(a) /= pairs[a];
  // Of the distances, those that there are, and the first.
  Eigen::Index used = 1;
  for (Eigen::Index k = 1; k < kDistances; ++k)
    if (!result.K.col(k).isZero(0.0)) {
      result.K.col(used) = result.K.col(k).eval();
      result.distances[used++] = result.distances[k];
    }
  result.K.conservativeResize(Eigen::NoChange, used);
  result.distances.conservativeResize(used);
  return result;
}

} // namespace holdfast
