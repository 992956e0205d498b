/// \file What holdfast simulate was asked for.
#pragma once

#include <holdfast/simulation/simulator.h>

#include <cstdint>
#include <optional>
#include <string>

namespace holdfast::app {

/// Of a camera that moves; `trajectory` empty: it does not.
struct TrajectoryArguments {
  std::string trajectory; ///< "walk", "circle" or a file
  std::optional<int> frames;
  std::optional<double> step_m;
  bool fresh_pattern = false;
  std::optional<double> odometry_sigma_rad;
  std::optional<double> odometry_sigma_m;

  /// Otherwise its poses are from a file.
  bool isMadeUp() const
  {
    return trajectory == "walk" || trajectory == "circle";
  }

  double step() const
  {
    return step_m.value_or(0.1);
  }

  bool wantsOdometry() const
  {
    return odometry_sigma_rad || odometry_sigma_m;
  }
};

struct SimulateArguments {
  std::string scene;
  std::string output;
  std::optional<double> distance_m;
  std::string sensor = "kinect_v1";
  int stride = 1;
  std::uint64_t random_seed = 1;
  SimulationOptions simulation;
  bool no_pattern = false;
  bool covariance = false;
  bool quiet = false;
  bool ascii = false;
  TrajectoryArguments moving;
};

} // namespace holdfast::app
