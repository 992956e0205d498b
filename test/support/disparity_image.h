/// \file Point images from disparities.
#pragma once

#include <holdfast/sensor/noise_calibration.h>

#include <functional>

namespace holdfast::test {

inline constexpr double kFocalTimesBaseline = 580.0 * 0.075; // px m

/// A point image from a disparity of each pixel, on the ray grid.
inline PointImage
imageOf(const Camera& camera, const std::function<double(int u, int v)>& disparity)
{
  PointImage image{camera.width, camera.height, {}};
  for (int v = 0; v < camera.height; ++v)
    for (int u = 0; u < camera.width; ++u)
      image.points.push_back(
          camera.backProject(u, v, kFocalTimesBaseline / disparity(u, v))
              .cast<float>());
  return image;
}

} // namespace holdfast::test
