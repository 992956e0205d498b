/// \file How large the noise of a stereo or structured-light camera is, from frames of
/// a scene that does not move.
///
/// Everything is measured in disparity, d = f b / z, where such a camera measures. A
/// plane is exactly affine there, d = a u + b v + c over the pixels (u, v), so that
/// what is left of it after linear least squares is the error of the disparity. Two
/// things are told apart:
///
///   temporal        what changes from frame to frame in one pixel;
///   fixed pattern   what stays: the mean of all frames is no plane either. What the
///                   surfaces themselves are uneven is part of it.
///
/// A fit to a single frame sees both: single^2 = temporal^2 + fixed^2.
#pragma once

#include <holdfast/sensor/camera.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

namespace holdfast {

/// An organized image of points, row by row, camera frame, m. Invalid: NaN or z <= 0.
struct PointImage {
  int width = 0;
  int height = 0;
  std::vector<Eigen::Vector3f> points;
};

/// A number and its 95 % confidence interval; NaN where the data cannot tell.
struct Estimate {
  double value = std::numeric_limits<double>::quiet_NaN();
  double low = std::numeric_limits<double>::quiet_NaN();
  double high = std::numeric_limits<double>::quiet_NaN();

  bool isKnown() const
  {
    return std::isfinite(value);
  }

  bool contains(double number) const
  {
    return low <= number && number <= high;
  }
};

struct NoiseCalibrationOptions {
  Camera camera; ///< of the images
  double baseline_m = 0.075;
  double focal_px = 580.0; ///< of the image the disparity is measured in
  /// Side of the square regions to which planes are fitted, px; 0: whole planes. A
  /// small region takes the long waves of the fixed pattern into its plane, where they
  /// are an error of the plane that its residual does not show.
  int region_px = 0;
};

/// Empty when the options make sense, else one sentence naming the first that does not.
std::string validityError(const NoiseCalibrationOptions& options);

/// Standard deviations of the disparity, px, as reported: with the rounding.
struct DisparitySigmas {
  Estimate single; ///< about planes within a frame
  Estimate temporal; ///< NaN for one frame
  Estimate fixed; ///< from the mean of all frames; NaN for one frame
};

/// The single-frame sigma about planes fitted to regions of one size.
struct RegionSizeRow {
  int size_px = 0; ///< side; 0: whole planes
  int regions = 0;
  Estimate single;
};

/// The sigmas of the pixels in one range of depths.
struct DepthRow {
  double min_m = 0.0, max_m = 0.0, mean_m = 0.0;
  int pixels = 0;
  DisparitySigmas sigmas;
};

enum class NoiseCalibrationStatus : std::uint8_t {
  Ok,
  NothingStatic, ///< no pixel saw the same thing in most frames
  NothingFlat ///< nothing flat enough to fit planes to
};

/// All sigmas belong to the same pixels: flat, and static where there are several
/// frames. Intervals are weighted delete-one-cell jackknifes over an 8 x 6 grid of
/// image cells, since the pattern of neighbouring pixels is not independent: they hold
/// for patterns whose waves are shorter than such a cell.
struct NoiseCalibration {
  NoiseCalibrationStatus status = NoiseCalibrationStatus::NothingStatic;
  int frames = 0;
  int pixels = 0; ///< per frame
  /// Flat surfaces found; 0: only small flat spots of curved surfaces, in which waves
  /// of the pattern longer than region_px do not show.
  int planes = 0;
  int region_px = 0; ///< regions behind `sigmas`; 0: whole planes
  double min_m = 0.0, mean_m = 0.0, max_m = 0.0; ///< depths of the pixels

  DisparitySigmas sigmas;
  /// fixed pattern as the difference sqrt(single^2 - temporal^2). It agrees with
  /// sigmas.fixed when scene and sensor rested.
  Estimate fixed_from_difference;
  /// The step in which disparities are reported, px; NaN where there is none. Depths
  /// rounded as well shift it by more than the interval says when they hardly differ.
  Estimate quantum;
  /// Sigmas before the disparities were rounded to that step; NaN without one, and
  /// where the disparities of the surfaces spread over less than a few steps.
  DisparitySigmas before_rounding;
  /// Scatter of the points across the nominal rays of their pixels, in one image
  /// direction, px; NaN where the points lie on these rays, so that nothing can be said
  /// about the pointing error.
  Estimate sigma_point;

  std::vector<RegionSizeRow> by_region_size;
  std::vector<DepthRow> by_depth; ///< from near to far
  /// p in single ~ z^p, linearised at the mean depth: 0 where the disparity noise is
  /// constant; NaN where the depths hardly differ.
  Estimate depth_exponent;
};

/// Measures all that the frames can tell. Surfaces count as flat when their radius of
/// curvature is 4 m or more. Pixels that saw something else in single frames, dropouts
/// and edges are left out: values away from the median of their pixel by more than ten
/// typical changes between frames, pixels with less than half of the frames, and 8 x 8
/// tiles that are not there by three quarters or whose variance, in space or time, is
/// four times that of the tiles at their depth.
///
/// The planes are fitted over the pixels, not over the measured rays: scatter across
/// the rays, which would add (a^2 + b^2) sigma_point^2 to the residual, does not enter
/// it. A pointing error of points that were put back on their nominal rays cannot be
/// told from one of the disparity, and is part of it.
///
/// \throw std::invalid_argument when there is no frame, their sizes differ or do not
/// match their points, or an option makes no sense.
NoiseCalibration calibrateNoise(const std::vector<PointImage>& frames,
                                const NoiseCalibrationOptions& options);

/// Mean of (Q1 - Q2)^2 / 2 of one pixel's disparities in two frames, px^2, when noise
/// of standard deviation sigma is rounded to multiples of the quantum and the true
/// value lies anywhere between two of them.
double roundedTemporalVariance(double sigma_px, double quantum_px);

/// The sigma for which roundedTemporalVariance() is `variance`; 0 for a variance of 0.
double sigmaBeforeRounding(double variance_px2, double quantum_px);

} // namespace holdfast
