/// \file White noise and waves behind what was measured of a pattern.
#pragma once

#include "blocks.h"

#include <holdfast/noise_pattern.h>

#include <Eigen/Core>

#include <vector>

namespace holdfast {

/// Of waves longer than half the distances that blocks are compared over, these show
/// little but how steeply they begin: sigma and length could grow without end.
inline constexpr double kLongestWave = 0.5 * kBlockBins * kBlockSize; // px

/// What a pattern is expected to add to each of the rows measured: mean squares of
/// second differences over six, then mean products of residuals of blocks, both px^2.
/// Linear in the variances of the white part and the waves.
class PatternDesign {
public:
  /// \param differences distances of the second differences, px.
  PatternDesign(Eigen::ArrayXd differences, const BlockCorrelogram& blocks);

  Eigen::Index rows() const;

  /// Of white noise of variance 1.
  Eigen::ArrayXd white() const;

  /// Of a wave of variance 1.
  Eigen::ArrayXd wave(PatternShape shape, double length) const;

private:
  Eigen::ArrayXd differences_;
  Eigen::ArrayXd distances_; ///< between blocks
  Eigen::MatrixXd K_;
};

struct PatternData {
  Eigen::ArrayXd values;
  Eigen::ArrayXd weights; ///< 0: not there
};

/// What is fitted, in numbers whose errors are about symmetric.
struct WaveFit {
  double white = 0.0; ///< variance, px^2
  std::vector<double> variances; ///< px^2, of the waves
  std::vector<double> log_lengths; ///< of lengths in px
  std::vector<PatternShape> shapes;
  double error = 0.0; ///< weighted sum of squared residuals

  double single() const;
  Eigen::ArrayXd expected(const PatternDesign& design) const;
};

/// Least squares with variances that are not negative: linear in these, and searched in
/// the lengths, at first on a grid over all.
/// \param shapes of the waves, the shortest first.
WaveFit fitWaves(const PatternDesign& design,
                 const PatternData& data,
                 const std::vector<PatternShape>& shapes);

/// As fitWaves(), searched from the lengths of a fit to similar data.
WaveFit refitWaves(const PatternDesign& design,
                   const PatternData& data,
                   const WaveFit& start);

/// The best variances for given lengths.
WaveFit fitVariances(const PatternDesign& design,
                     const PatternData& data,
                     const std::vector<PatternShape>& shapes,
                     const std::vector<double>& log_lengths);

} // namespace holdfast
