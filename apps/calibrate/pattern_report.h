/// \file What a calibration found of the pattern.
#pragma once

#include "noise_report.h"

#include <string>
#include <vector>

namespace holdfast::app {

std::vector<std::vector<std::string>> patternTable(const NoiseReport& report);

/// What the pattern means and what cannot be told of it.
std::vector<std::string> patternSentences(const NoiseReport& report);

/// Null where there was no plane.
nlohmann::ordered_json patternJson(const NoiseReport& report);

/// What the map is worth. Empty without one.
std::string patternMapSentence(const NoiseReport& report);

/// Null without a map.
nlohmann::ordered_json patternMapJson(const NoiseReport& report);

/// Over the distance of the pixels, short and long, with the fitted curves; none where
/// there was no plane.
std::vector<Panel> patternPanels(const NoiseReport& report);

/// With the digits that are written.
NoisePattern roundedPattern(const NoiseReport& report);

/// For the sensor file.
std::string patternComment(const NoiseReport& report);

} // namespace holdfast::app
