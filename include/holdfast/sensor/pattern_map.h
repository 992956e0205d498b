/// \file The part of a stereo camera's error that stays with its pixels.
#pragma once

#include <Eigen/Core>

#include <cstddef>
#include <vector>

namespace holdfast {

/// By how much the disparity of each pixel is too large, px, whatever the camera looks
/// at: a property of lens and projector, measured by calibratePatternMap(). Pixels of
/// which nothing is known have no error. What is left once the map is subtracted is the
/// sensor's NoisePattern.
///
/// It holds best at the depths at which it was measured.
class PatternMap {
public:
  /// \param errors_px width * height of them, row by row; NaN: unknown.
  /// \throw std::invalid_argument when their number is another, or one is infinite.
  PatternMap(int width, int height, std::vector<float> errors_px);

  int width() const
  {
    return width_;
  }

  int height() const
  {
    return height_;
  }

  /// Row by row, px of disparity; NaN: unknown.
  const std::vector<float>& errors() const
  {
    return errors_;
  }

  /// Of the pixel with this index, row by row; 0 where it is unknown. px.
  double error(std::size_t pixel) const
  {
    const float e = errors_[pixel];
    return e == e ? static_cast<double>(e) : 0.0;
  }

private:
  int width_;
  int height_;
  std::vector<float> errors_;
};

/// The point q, camera frame, without an error of its disparity: with d = f b / z it
/// moves along its ray from z = f b / d to f b / (d - error). NaN where nothing is left
/// of the disparity.
/// \param focal_times_baseline f b, px m.
Eigen::Vector3d withoutDisparityError(const Eigen::Vector3d& q,
                                      double error_px,
                                      double focal_times_baseline);

} // namespace holdfast
