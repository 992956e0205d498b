/// \file The parameters of the node that stay as they are.
#pragma once

#include "core/settings.h"
#include "ros1/markers.h"

#include <ros/node_handle.h>

#include <chrono>

namespace holdfast::robot {

enum class Input : std::uint8_t { Cloud, Depth };

struct NodeParameters {
  Settings settings;
  MarkerOptions markers;
  Input input = Input::Cloud;
  int queue = 1; ///< frames that may wait
  std::chrono::duration<double> transform_timeout{0.2}; ///< by the wall's clock
  std::chrono::duration<double> warning_period{10.0};
};

/// \throw std::runtime_error for a parameter that nobody knows, has the wrong type, or
/// makes no sense.
NodeParameters readParameters(const ros::NodeHandle& own);

} // namespace holdfast::robot
