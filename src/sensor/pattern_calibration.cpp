#include <holdfast/sensor/pattern_calibration.h>

#include "noise_calibration/contrasts.h"
#include "noise_calibration/pose_planes.h"
#include "noise_calibration/wave_fit.h"

#include <holdfast/geometry/constants.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

namespace holdfast {
namespace {

// Longer steps that only so small a part of the pixels allow say little.
constexpr double kLeastTriples = 0.05;
constexpr double kLeastPairs = 0.05;

// Two-sided 95 % of a normal distribution.
constexpr double kNormal95 = 1.96;

// Over shorter distances, what changes with time hides what poses share.
constexpr double kLeastShared = 8.0; // px

// An interval that comes as close to the longest length that is searched is cut off
// there.
constexpr double kCutOff = 1e-3;

constexpr int kReweightings = 3;

/// The sums of contrastSums(), then those of a BlockCorrelogram.
const Eigen::Index kDifferences = static_cast<Eigen::Index>(contrastSteps().size());
const Eigen::Index kRows = kDifferences + kBlockBins;

Eigen::ArrayXd
column(const Eigen::ArrayXd& sums, ContrastSum which)
{
  return Eigen::Map<const Eigen::ArrayXd, 0, Eigen::InnerStride<kContrastSums>>(
      sums.data() + which,
      kDifferences);
}

Eigen::ArrayXd
column(const Eigen::ArrayXd& sums, BlockSum which)
{
  return Eigen::Map<const Eigen::ArrayXd, 0, Eigen::InnerStride<kBlockSums>>(
      sums.data() + kDifferences * kContrastSums + which,
      kBlockBins);
}

double
distanceOf(Eigen::Index difference)
{
  return contrastSteps()[static_cast<std::size_t>(difference)].distance();
}

/// Of second differences, over six; NaN where nothing was summed.
Eigen::ArrayXd
meansOf(const Eigen::ArrayXd& sums, ContrastSum total, ContrastSum count)
{
  return column(sums, total) / column(sums, count) / 6.0;
}

/// All that is fitted.
Eigen::ArrayXd
meansOf(const Eigen::ArrayXd& sums)
{
  Eigen::ArrayXd means(kRows);
  means << meansOf(sums, WithinFrame, WithinFrames),
      column(sums, BlockProducts) / column(sums, BlockPairs);
  return means;
}

/// Only second differences.
Eigen::ArrayXd
meansOfDifferences(const Eigen::ArrayXd& sums, ContrastSum total, ContrastSum count)
{
  Eigen::ArrayXd means =
      Eigen::ArrayXd::Constant(kRows, std::numeric_limits<double>::quiet_NaN());
  means.head(kDifferences) = meansOf(sums, total, count);
  return means;
}

PatternData
dataOf(const Eigen::ArrayXd& means, const Eigen::ArrayXd& weights)
{
  // A cell that is left out may have been the only one with such a distance.
  const auto is_there = means.isFinite();
  return {is_there.select(means, 0.0), is_there.select(weights, 0.0)};
}

/// Variances of the rows but for one factor. For second differences relative to their
/// squares and as a power of the distance, for blocks the same for all: those of single
/// rows are too uncertain to weigh by. Infinite: not to be used.
Eigen::ArrayXd
rowVariances(const std::vector<CellSums>& cells, const Eigen::ArrayXd& total)
{
  const auto all = [](const Eigen::ArrayXd& sums) { return meansOf(sums); };
  const std::vector<Estimate> means = jackknifeAll(cells, all);
  const Eigen::ArrayXd counts = column(total, WithinFrames);
  const Eigen::ArrayXd pairs = column(total, BlockPairs);
  Eigen::Matrix2d A = Eigen::Matrix2d::Zero();
  Eigen::Vector2d b = Eigen::Vector2d::Zero();
  double blocks = 0.0, block_rows = 0.0;
  Eigen::ArrayXd variances =
      Eigen::ArrayXd::Constant(kRows, std::numeric_limits<double>::infinity());
  for (Eigen::Index a = 0; a < kRows; ++a) {
    const Estimate& mean = means[static_cast<std::size_t>(a)];
    const double error = mean.high - mean.low;
    if (!(error > 0.0))
      continue;
    if (a >= kDifferences && pairs[a - kDifferences] >= kLeastPairs * pairs[0]) {
      blocks += error * error;
      block_rows += 1.0;
      variances[a] = 1.0;
    }
    // The long ones, too, although blocks tell more of long waves: how bent a pattern
    // makes a patch shows nowhere else, and one that fits at either end may be wrong by
    // half between.
    if (a < kDifferences && counts[a] >= kLeastTriples * counts[0]) {
      const Eigen::Vector2d terms(1.0, std::log(distanceOf(a)));
      A += terms * terms.transpose();
      b += 2.0 * std::log(error / mean.value) * terms;
      variances[a] = 1.0;
    }
  }
  const Eigen::Vector2d power = A.fullPivLu().solve(b);
  for (Eigen::Index a = 0; a < kRows; ++a)
    variances[a] *= a < kDifferences ?
                        std::exp(power[0] + power[1] * std::log(distanceOf(a))) :
                        blocks / block_rows;
  return variances;
}

/// Pixels on planes in the pose that has most of them.
double
largestArea(const std::vector<PlaneImages>& poses)
{
  std::ptrdiff_t largest = 0;
  for (const PlaneImages& pose : poses)
    largest = std::max(largest,
                       std::count_if(pose.plane.begin(),
                                     pose.plane.end(),
                                     [](std::int16_t plane) { return plane > 0; }));
  return static_cast<double>(largest);
}

/// Sums by cell, those of the blocks behind those of the differences.
std::vector<CellSums>
joined(std::vector<CellSums> cells, const std::vector<CellSums>& blocks)
{
  for (std::size_t k = 0; k < cells.size(); ++k) {
    Eigen::ArrayXd both(cells[k].sums.size() + blocks[k].sums.size());
    both << cells[k].sums, blocks[k].sums;
    cells[k].sums = both;
  }
  return cells;
}

/// The fit of the whole and, by delete-one, what its numbers are uncertain by.
class PatternFit {
public:
  /// \param area of the planes in one pose, px^2.
  PatternFit(const std::vector<CellSums>& cells,
             const PatternDesign& design,
             double area)
  : cells_(cells), design_(design), area_(area)
  {
    total_ = Eigen::ArrayXd::Zero(cells.front().sums.size());
    for (const CellSums& cell : cells)
      total_ += cell.sums;
    variances_ = rowVariances(cells, total_);
    weigh(meansOf(total_));
  }

  /// Exponential waves, unless a Gaussian last one is clearly better. Within a patch a
  /// Gaussian wave is nearly plane and an exponential one rough: where the data do not
  /// tell, the latter promises less.
  void fit(std::size_t waves)
  {
    std::vector<PatternShape> shapes(waves, PatternShape::Exponential);
    fitShapes(shapes);
    if (waves == 0)
      return;
    shapes.back() = PatternShape::Gaussian;
    if (isClearlyBetter(shapes))
      fitShapes(shapes);
  }

  bool hasOnlyWaves() const
  {
    for (std::size_t m = 0; m < waves(); ++m) {
      if (!(estimates_[2 + 2 * waves() + m].low > 0.0))
        return false;
    }
    return true;
  }

  void write(PatternCalibration& result) const
  {
    double square = 0.0;
    for (std::size_t m = 0; m < waves(); ++m)
      square += std::pow(samplingError(m) * estimates_[2 + m].value, 2);
    result.single = rootOf(widened(estimates_[0], std::sqrt(square)));
    result.white = rootOf(estimates_[1]);
    for (std::size_t m = 0; m < waves(); ++m) {
      const double error = samplingError(m);
      const Estimate& variance = estimates_[2 + m];
      const Estimate& log_length = estimates_[2 + waves() + m];
      result.waves.push_back({rootOf(widened(variance, error * variance.value)),
                              lengthOf(widened(log_length, lengthError(m))),
                              fit_.shapes[m]});
    }
    result.shared_part = estimates_.back();
    const Eigen::ArrayXd expected =
        temporal_.white * design_.white() + fit_.expected(design_);
    for (std::size_t a = 0; a < result.rows.size(); ++a)
      result.rows[a].fitted = expected[static_cast<Eigen::Index>(a)];
    for (std::size_t a = 0; a < result.distant.size(); ++a)
      result.distant[a].fitted = expected[kDifferences + static_cast<Eigen::Index>(a)];
  }

private:
  std::size_t waves() const
  {
    return fit_.shapes.size();
  }

  void fitShapes(const std::vector<PatternShape>& shapes)
  {
    temporal_ = {};
    if (hasFrames(total_))
      temporal_ = fitWaves(design_, changesOf(total_), {PatternShape::Exponential});
    for (int round = 0; round < kReweightings; ++round) {
      fit_ = fitWaves(design_, aboveFloor(total_, temporal_.white), shapes);
      weigh(temporal_.white * design_.white() + fit_.expected(design_));
    }
    estimates_ = jackknifeAll(cells_, [&](const Eigen::ArrayXd& sums) {
      return numbersOf(sums);
    });
  }

  /// Whether the misfit with these shapes is less than that of the fit by more than
  /// their difference is uncertain by, with the weights of the fit for both.
  bool isClearlyBetter(const std::vector<PatternShape>& shapes) const
  {
    const WaveFit other =
        fitWaves(design_, aboveFloor(total_, temporal_.white), shapes);
    const Estimate gain = jackknife(cells_, [&](const Eigen::ArrayXd& sums) {
      const PatternData data = aboveFloor(sums, temporalOf(sums).white);
      return refitWaves(design_, data, fit_).error -
             refitWaves(design_, data, other).error;
    });
    return gain.low > 0.0;
  }

  /// What changes from frame to frame, near that of the whole.
  WaveFit temporalOf(const Eigen::ArrayXd& sums) const
  {
    return hasFrames(sums) ? refitWaves(design_, changesOf(sums), temporal_) :
                             WaveFit{};
  }

  /// Half the 95 % interval of a wave's variance, relative, for the number of its
  /// pieces in the planes alone: the mean square over an area A has the relative
  /// variance 2 / A times the integral of rho^2.
  double samplingError(std::size_t m) const
  {
    const double length = std::exp(fit_.log_lengths[m]);
    const double share = fit_.shapes[m] == PatternShape::Exponential ? 0.5 : 1.0;
    return kNormal95 * std::sqrt(2.0 / area_ * share * kPi * length * length);
  }

  /// How steeply a wave begins is known well, sigma^2 / length of an exponential one
  /// and sigma^2 / length^2 of a Gaussian: its length errs with its sigma.
  double lengthError(std::size_t m) const
  {
    const bool exponential = fit_.shapes[m] == PatternShape::Exponential;
    return (exponential ? 1.0 : 0.5) * samplingError(m);
  }

  /// The jackknife sees how the cells differ, but not that the waves all of them share
  /// are few: in quadrature.
  static Estimate widened(const Estimate& estimate, double half)
  {
    return {estimate.value,
            estimate.value - std::hypot(estimate.value - estimate.low, half),
            estimate.value + std::hypot(estimate.high - estimate.value, half)};
  }

  static Estimate lengthOf(const Estimate& log_length)
  {
    Estimate length{std::exp(log_length.value),
                    std::exp(log_length.low),
                    std::exp(log_length.high)};
    if (length.high >= (1.0 - kCutOff) * kLongestWave)
      length.high = std::numeric_limits<double>::infinity();
    return length;
  }

  /// NaN without a second pose.
  static double sharedPart(const Eigen::ArrayXd& sums)
  {
    const Eigen::ArrayXd poses = meansOf(sums, BetweenPoses, BetweenPoseCount);
    const Eigen::ArrayXd within = meansOf(sums, WithinFrame, WithinFrames);
    double shared = 0.0, whole = 0.0;
    for (Eigen::Index a = 0; a < kDifferences; ++a)
      if (distanceOf(a) >= kLeastShared && std::isfinite(poses[a])) {
        shared += poses[a];
        whole += within[a];
      }
    return shared / whole;
  }

  static bool hasFrames(const Eigen::ArrayXd& sums)
  {
    return column(sums, BetweenFrameCount)[0] > 0.0;
  }

  PatternData changesOf(const Eigen::ArrayXd& sums) const
  {
    return dataOf(meansOfDifferences(sums, BetweenFrames, BetweenFrameCount), weights_);
  }

  /// What is left for the fit when so much is known to be white.
  PatternData aboveFloor(const Eigen::ArrayXd& sums, double white) const
  {
    return dataOf(meansOf(sums) - white * design_.white(), weights_);
  }

  /// By values that were fitted, at last: weights by the measured ones would prefer the
  /// low ones.
  void weigh(const Eigen::ArrayXd& values)
  {
    Eigen::ArrayXd variances = variances_;
    variances.head(kDifferences) *= values.head(kDifferences).square();
    weights_ = (variances > 0.0 && variances.isFinite()).select(1.0 / variances, 0.0);
  }

  Eigen::ArrayXd numbersOf(const Eigen::ArrayXd& sums) const
  {
    const WaveFit temporal = temporalOf(sums);
    const WaveFit fit = refitWaves(design_, aboveFloor(sums, temporal.white), fit_);
    // Long waves and their lengths are known together less well than that there are
    // any.
    const WaveFit at_lengths = fitVariances(design_,
                                            aboveFloor(sums, temporal.white),
                                            fit_.shapes,
                                            fit_.log_lengths);
    Eigen::ArrayXd numbers(static_cast<Eigen::Index>(3 + 3 * fit.shapes.size()));
    Eigen::Index k = 0;
    numbers[k++] = temporal.white + fit.single();
    numbers[k++] = temporal.white + fit.white;
    for (const double variance : fit.variances)
      numbers[k++] = variance;
    for (const double length : fit.log_lengths)
      numbers[k++] = length;
    for (const double variance : at_lengths.variances)
      numbers[k++] = variance;
    numbers[k++] = sharedPart(sums);
    return numbers;
  }

  const std::vector<CellSums>& cells_;
  const PatternDesign& design_;
  double area_;
  Eigen::ArrayXd total_;
  Eigen::ArrayXd variances_;
  Eigen::ArrayXd weights_;
  WaveFit temporal_; ///< its white part is the least of the whole
  WaveFit fit_; ///< what is above that
  std::vector<Estimate> estimates_; ///< of numbersOf()
};

std::vector<PatternRow>
rowsOf(const std::vector<CellSums>& cells)
{
  const auto estimates = [&](ContrastSum total, ContrastSum count) {
    return jackknifeAll(cells, [=](const Eigen::ArrayXd& sums) {
      return meansOf(sums, total, count);
    });
  };
  const std::vector<Estimate> within = estimates(WithinFrame, WithinFrames);
  const std::vector<Estimate> frames = estimates(BetweenFrames, BetweenFrameCount);
  const std::vector<Estimate> poses = estimates(BetweenPoses, BetweenPoseCount);
  std::vector<PatternRow> rows;
  for (std::size_t a = 0; a < within.size(); ++a)
    rows.push_back(
        {contrastSteps()[a].distance(), within[a], frames[a], poses[a], 0.0});
  return rows;
}

std::vector<DistantRow>
distantRowsOf(const std::vector<CellSums>& cells, const BlockCorrelogram& blocks)
{
  const std::vector<Estimate> means = jackknifeAll(cells, [](const auto& sums) {
    return Eigen::ArrayXd(column(sums, BlockProducts) / column(sums, BlockPairs));
  });
  std::vector<DistantRow> rows;
  for (std::size_t a = 0; a < means.size(); ++a)
    rows.push_back({blocks.bin_distances[static_cast<Eigen::Index>(a)], means[a], 0.0});
  return rows;
}

} // namespace

NoisePattern
PatternCalibration::pattern() const
{
  NoisePattern pattern;
  for (const WaveEstimate& wave : waves)
    pattern.waves.push_back({wave.sigma.value, wave.length.value, wave.shape});
  return pattern;
}

PatternCalibration
calibratePattern(const std::vector<PoseFrames>& poses,
                 const NoiseCalibrationOptions& options)
{
  if (const std::string error = validityError(options); !error.empty())
    throw std::invalid_argument(error);
  requireSameSizes(poses);
  std::vector<PosePlanes> planes;
  for (const PoseFrames& pose : poses) {
    planes.push_back(findPosePlanes(pose, options));
    if (const auto status = planes.back().status;
        status != NoiseCalibrationStatus::Ok) {
      PatternCalibration result;
      result.status = status;
      result.pose = static_cast<int>(planes.size()) - 1;
      result.poses = static_cast<int>(poses.size());
      return result;
    }
  }
  return patternOn(std::move(planes));
}

PatternCalibration
patternOn(std::vector<PosePlanes> poses)
{
  PatternCalibration result;
  result.status = NoiseCalibrationStatus::Ok;
  result.poses = static_cast<int>(poses.size());
  BlockCorrelogramBuilder builder;
  std::vector<PlaneImages> images;
  for (PosePlanes& pose : poses) {
    for (const Region& plane : pose.regions)
      builder.add(pose.tiles, plane);
    images.push_back(std::move(pose.images));
  }
  const BlockCorrelogram blocks = builder.finish();
  const std::vector<CellSums> cells = joined(contrastSums(images), blocks.cells);
  result.rows = rowsOf(cells);
  result.distant = distantRowsOf(cells, blocks);
  Eigen::ArrayXd distances(kDifferences);
  for (Eigen::Index a = 0; a < kDifferences; ++a)
    distances[a] = distanceOf(a);
  const PatternDesign design(distances, blocks);
  PatternFit fit(cells, design, largestArea(images));
  std::size_t waves = 2;
  fit.fit(waves);
  while (!fit.hasOnlyWaves())
    fit.fit(--waves);
  fit.write(result);
  return result;
}

} // namespace holdfast
