/// \file Do the points lie where the sensor can have seen them?
#pragma once

#include "unused_points.h"

#include <holdfast/pcl/range_cloud.h>
#include <holdfast/sensor/sensor.h>

#include <string>

namespace holdfast {

/// What the field of view and the range of a camera say of a cloud: whether it can have
/// taken it, and, if not, which common mistake explains that (other axes, other units).
/// Refers to cloud and sensor.
class ViewCheck {
public:
  ViewCheck(const RangeCloud& cloud, const Sensor& sensor);

  /// Most points lie where the sensor cannot have measured them.
  bool isForeign() const;

  /// The points surround the place of the sensor, as a closed model around the origin
  /// or a spinning scanner's cloud do.
  bool isAllAround() const;

  /// Why the cloud is foreign and what was assumed instead.
  std::string foreignNotice() const;

  /// A likely mistake in a cloud that is not foreign; empty if none is seen.
  std::string hint() const;

  /// Leaves out what lies behind the camera or outside its view.
  void dropUnseen(UnusedPoints& unused) const;

private:
  struct Frame;
  double shareSeen(const Frame& frame) const;
  std::string likelyMistake() const;

  const RangeCloud& cloud_;
  const Sensor& sensor_;
  double share_seen_;
};

} // namespace holdfast
