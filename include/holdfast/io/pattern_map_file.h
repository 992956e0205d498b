/// \file Pattern maps as images.
#pragma once

#include <holdfast/sensor/pattern_map.h>

#include <string>

namespace holdfast {

/// A map from a 16-bit gray PNG: a pixel of value v has the error (v - 32768) / 1024 px
/// of disparity, 0 is unknown.
/// \throw std::runtime_error "FILE: cause" when it is missing, no such image, or
/// corrupt.
PatternMap loadPatternMap(const std::string& path);

/// Writes that. Errors are rounded to 1/1024 px and cut off at 31.99 px.
/// \throw std::runtime_error when the file cannot be written; then there is none, or
/// the one from before.
void savePatternMap(const std::string& path, const PatternMap& map);

} // namespace holdfast
