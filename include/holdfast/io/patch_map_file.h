/// \file Maps of patches to and from files.
#pragma once

#include <holdfast/fusion/patch_map.h>

#include <ostream>
#include <string>

namespace holdfast {

/// A map and the sensor whose frames made it.
struct StoredMap {
  PatchMap map;
  std::string sensor;
};

/// Writes a map bit for bit, so that it goes on as if it had not been stored: numbered
/// fields of the version that is written in front, and a checksum behind them.
/// \throw std::runtime_error when the file cannot be written; then there is none, or
/// the one from before.
void savePatchMap(const std::string& path, const StoredMap& stored);

/// The same into a stream.
void writePatchMap(std::ostream& out, const StoredMap& stored);

/// \throw std::runtime_error "FILE: cause" when it is missing, cut short, damaged, no
/// map, or of a later version.
StoredMap loadPatchMap(const std::string& path);

} // namespace holdfast
