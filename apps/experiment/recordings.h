/// \file Recorded frames of large planes for `experiment real`.
#pragma once

#include "recorded_plane.h"

#include <CLI/App.hpp>

#include <cstdint>
#include <string>
#include <vector>

namespace holdfast::app {

struct RecordingOptions {
  std::vector<std::string> clouds; ///< files; none: the mosd_*.pcd of the folder
  std::string folder;
  std::string sensor_name = "xtion";
};

/// Adds --clouds, --data and --sensor. `options` must outlive the parsing.
void addRecordingOptions(CLI::App& command, RecordingOptions& options);

struct RecordedCloud {
  std::string name; ///< of the file
  Sensor sensor; ///< with the camera of the cloud
  RangeCloud cloud;
  RecordedPlane plane;
};

/// Those that have a plane, in the order given or by name.
/// \param remarks is told what the reader decided, what was left out, and the planes.
/// \throw std::runtime_error when there is none, or one cannot be read or has no
///        pixels; CLI::ValidationError when nothing says where they are.
std::vector<RecordedCloud> loadRecordings(const RecordingOptions& options,
                                          std::uint64_t seed,
                                          std::vector<std::string>& remarks);

} // namespace holdfast::app
