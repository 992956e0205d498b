/// \file The files that a map is written to.
#pragma once

#include <holdfast/fusion/patch_map.h>
#include <holdfast/io/cloud_io.h>
#include <holdfast/pcl/patch_extraction.h>
#include <holdfast/sensor/sensor.h>

#include <optional>
#include <string>
#include <vector>

namespace holdfast::app {

/// True for *.json and *.map.
bool isMapOutput(const std::string& path);

struct MapOutput {
  std::vector<std::string> files; ///< isMapOutput()
  std::string ply; ///< empty: none
};

/// What is told of the frames of a map, beside its patches.
struct MapSource {
  std::string name; ///< of what the map was made from
  ExtractionOptions options;
  /// The one asked for, whatever noise was assumed in a frame, by whose name the map
  /// goes on; with the camera of the last frame.
  Sensor sensor;
  std::optional<CloudFileInfo> file; ///< how the last frame was read
  PointAccounting points; ///< of all frames
  std::vector<std::string> notices; ///< each once

  void addFrame(const ExtractionResult& frame);

  /// \return whether nobody has said so before.
  bool addNotice(const std::string& notice);
};

/// The patches of a map as fits: their types, and bounds.
std::vector<FitResult> fitsOf(const PatchMap& map, const FitOptions& options);

/// Writes all files or none.
/// \param fits of its patches, as fitsOf().
/// \throw std::runtime_error "PATH: cause".
void writeMap(const PatchMap& map,
              const MapSource& source,
              const std::vector<FitResult>& fits,
              const MapOutput& output);

} // namespace holdfast::app
