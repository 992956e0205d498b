/// \file The files that a map is written to.
#pragma once

#include <holdfast/fusion/patch_map.h>
#include <holdfast/pcl/patch_extraction.h>
#include <holdfast/sensor/sensor.h>

#include <string>
#include <vector>

namespace holdfast::app {

/// True for *.json and *.map.
bool isMapOutput(const std::string& path);

struct MapOutput {
  std::vector<std::string> files; ///< isMapOutput()
  std::string ply; ///< empty: none
};

/// The patches of a map as fits: their types, and bounds.
std::vector<FitResult> fitsOf(const PatchMap& map, const FitOptions& options);

/// Writes all files or none.
/// \param name of what the map was made from.
/// \param fits of its patches, as fitsOf().
/// \throw std::runtime_error "PATH: cause".
void writeMap(const PatchMap& map,
              const Sensor& sensor,
              const ExtractionOptions& options,
              const std::string& name,
              const std::vector<FitResult>& fits,
              const MapOutput& output);

} // namespace holdfast::app
