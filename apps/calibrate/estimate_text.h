/// \file Estimates and their intervals, in words and JSON.
#pragma once

#include <holdfast/sensor/noise_calibration.h>

#include <nlohmann/json.hpp>

#include <string>

namespace holdfast::app {

/// Three of them.
std::string digits(double value);

/// With no more digits than mean anything.
double rounded(double value);

/// "-" for what is not known.
std::string valueText(const Estimate& estimate);
std::string intervalText(const Estimate& estimate);
std::string valueAndInterval(const Estimate& estimate);

/// Null for what is not known.
nlohmann::ordered_json estimateJson(const Estimate& estimate);

} // namespace holdfast::app
