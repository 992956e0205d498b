/// \file From a cloud as it was brought to the points and the sensor that can be used.
#pragma once

#include <holdfast/pcl/point_accounting.h>
#include <holdfast/pcl/range_cloud.h>
#include <holdfast/sensor/sensor.h>

#include <string>
#include <vector>

namespace holdfast {

struct PointSelection {
  /// The same cloud with everything that cannot be used made invalid (NaN), so that
  /// indices keep their meaning. Shares the points where that changes nothing.
  RangeCloud cloud;
  /// The sensor whose noise holds for the cloud: the nominal one, or constant noise
  /// where that one cannot have taken the cloud.
  Sensor sensor;
  PointAccounting points;
  /// The noise is a guess, since the sensor's cannot hold.
  bool noise_is_assumed = false;
  /// False when nobody said where the cloud was taken from and the points do not look
  /// as if it were the assumed place: normals may then point to the wrong side.
  bool viewpoint_is_credible = true;
  std::vector<std::string> notices; ///< one line each
};

/// \throw std::invalid_argument when the cloud is inconsistent, or there is neither a
/// noise model nor covariances.
PointSelection selectPoints(const RangeCloud& cloud, const Sensor& nominal);

} // namespace holdfast
