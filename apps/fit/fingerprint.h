/// \file What results were made with, as one word.
#pragma once

#include <holdfast/sensor/sensor.h>

#include <CLI/App.hpp>

#include <string>

namespace holdfast::app {

/// Sixteen digits that differ when the version of Holdfast, the sensor (its camera, its
/// noise, its pattern and map; not its file's name) or the options of `holdfast fit`
/// do. Of the options all count that are given, as they are spelled, but for those that
/// say where results go or how much is said of them, what clouds there are, and the
/// number of threads.
std::string fingerprintOf(const CLI::App& command, const Sensor& sensor);

} // namespace holdfast::app
