/// \file The pattern of a stereo or structured-light camera, from planes it saw.
///
/// How much neighbouring pixels share of their error shows in the second differences of
/// the disparity along lines of the image,
///
///   e(u - D) - 2 e(u) + e(u + D),    with the variance  6 C(0) - 8 C(D) + 2 C(2 D)
///
/// for errors of covariance C, the white part included in C(0). A plane is affine in
/// the disparity and has none (Matheron, "The intrinsic random functions and their
/// applications", Advances in Applied Probability 5, 1973). Over longer distances,
/// products of what least-squares planes leave of the means of blocks of pixels say
/// more; they are compared with what such planes leave of the waves.
#pragma once

#include <holdfast/noise_pattern.h>
#include <holdfast/sensor/noise_calibration.h>

#include <vector>

namespace holdfast {

/// Frames of one resting scene from one place.
using PoseFrames = std::vector<PointImage>;

/// One wave of the pattern. Sigma in px of disparity, length in px of the image.
struct WaveEstimate {
  Estimate sigma;
  /// At most 80 px, half the distances compared: waves that are longer show there as
  /// such ones. An interval that reaches so far is open: its upper end is infinite.
  Estimate length;
  PatternShape shape = PatternShape::Exponential;
};

/// Mean squares of second differences at one distance, over six: px^2, the variance of
/// a single point where the points share nothing.
struct PatternRow {
  double distance_px = 0.0;
  Estimate within_frame;
  Estimate between_frames; ///< of what changes with time; NaN without a second frame
  Estimate between_poses; ///< of what is in the same pixels; NaN without a second pose
  double fitted = 0.0; ///< to within_frame
};

/// Mean products of what planes leave of the means of two blocks of 16 x 16 px, at one
/// distance between these, px^2.
struct DistantRow {
  double distance_px = 0.0;
  Estimate product;
  double fitted = 0.0; ///< with what the planes take of the waves
};

/// All sigmas in px of disparity. Intervals are delete-one-cell jackknifes as those of
/// NoiseCalibration, over 4 x 3 cells, since long waves reach across smaller ones. Few
/// pieces of such waves are in an image: the intervals of sigmas and lengths are
/// widened by what follows from their number.
struct PatternCalibration {
  NoiseCalibrationStatus status = NoiseCalibrationStatus::NothingStatic;
  int pose = 0; ///< of which the status speaks
  int poses = 0;
  Estimate single; ///< of a single point within a frame: white part and waves
  Estimate white; ///< what neighbours do not share, with the rounding
  std::vector<WaveEstimate> waves; ///< the shortest first; none: independent errors
  /// What of the second differences over 8 to 75 px is found in the same pixels of
  /// other poses, and thus belongs to the camera. The rest changes with time or with
  /// the distance, or is the shape of the surfaces. NaN for one pose.
  Estimate shared_part;
  std::vector<PatternRow> rows; ///< by distance
  std::vector<DistantRow> distant; ///< by distance

  NoisePattern pattern() const;
};

/// White part and waves that fit the mean squares of second differences best, by
/// weighted least squares: none, one or two waves, as many as have variances whose 95 %
/// intervals are above zero. All are exponential, but the longest is Gaussian where
/// that fits better by more than the difference is uncertain by: a Gaussian wave is
/// nearly plane within a patch, and taken for granted promises more than the data show.
/// Where there are several frames, the white part is at least that of what changes
/// between them.
///
/// \param poses with the pixels of all at the same places of the sensor. Only planes
/// count: small flat spots are too small for long waves.
/// \throw std::invalid_argument as calibrateNoise(), for sizes that differ between
/// poses, too.
PatternCalibration calibratePattern(const std::vector<PoseFrames>& poses,
                                    const NoiseCalibrationOptions& options);

} // namespace holdfast
