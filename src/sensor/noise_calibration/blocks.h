/// \file What the means of blocks of pixels share over long distances.
#pragma once

#include "jackknife.h"
#include "regions.h"
#include "tiles.h"

#include <Eigen/Core>

#include <vector>

namespace holdfast {

inline constexpr int kBlockSize = 2 * kTileSize; // px
/// Bins of distances between blocks, of one block's width about 1, 2, ... blocks: to
/// 168 px.
inline constexpr int kBlockBins = 10;

/// Indices of the sums of a bin.
enum BlockSum {
  BlockProducts, ///< of residuals of two blocks to their plane, px^2
  BlockPairs,
  kBlockSums
};

/// Means of r_i r_j over the pairs of blocks in a bin, and what these are to be. The
/// residuals r = (I - P) e of blocks to their own plane have less covariance than their
/// errors e, since the plane takes part of long waves. With A_a the pairs of bin a,
///
///   E[sum r_i r_j] = tr(A_a (I - P) C (I - P)) = sum_d K_ad C(d)
///
/// over all distances d between blocks: K follows from the outline of the planes.
struct BlockCorrelogram {
  std::vector<CellSums> cells; ///< sums of all bins, one after the other
  Eigen::ArrayXd distances; ///< d of the columns of K, px; the first is 0
  Eigen::MatrixXd K; ///< per pair of the bin; 0 where there is none
  Eigen::ArrayXd bin_distances; ///< means over the pairs, px
};

/// Sums over the planes of all poses.
class BlockCorrelogramBuilder {
public:
  BlockCorrelogramBuilder();

  void add(const TileImage& tiles, const Region& plane);

  BlockCorrelogram finish() const;

private:
  BlockCorrelogram sums_; ///< K not yet divided by the numbers of pairs
};

} // namespace holdfast
