/// \file What became of the points of a cloud.
#pragma once

#include <string>

namespace holdfast {

/// Every point of a cloud is counted once, under the first reason that holds:
/// in_cloud == invalid + behind_camera + out_of_view + invalid_covariance + duplicate
///             + used.
struct PointAccounting {
  int in_cloud = 0;
  int invalid = 0; ///< not finite: nothing was measured
  int behind_camera = 0; ///< where the sensor's noise model has no meaning
  /// Beside the sensor's field of view or beyond its range, each with a factor of two
  /// for wide lenses and long looks: its noise model says nothing there.
  int out_of_view = 0;
  int invalid_covariance = 0; ///< not finite, or not positive semi-definite
  int duplicate = 0; ///< exactly where an earlier point lies
  int used = 0; ///< open to neighbourhoods and fits

  int valid() const
  {
    return in_cloud - invalid;
  }

  PointAccounting& operator+=(const PointAccounting& other);
};

/// "12 of 500 points are left out: 10 behind the camera, 2 duplicates"; empty when
/// every valid point is used.
std::string leftOutText(const PointAccounting& points);

} // namespace holdfast
