/// \file The options that say which camera delivers, and how.
#pragma once

#include "grabber_run.h"

#include <holdfast/io/openni2_grabber.h>

#include <CLI/App.hpp>

namespace holdfast::app {

/// Adds --device, --list, --size, --registration, --every-frame and --no-reconnect.
/// `options` must outlive the parsing.
void addDeviceOptions(CLI::App& command, Openni2Options& options);

/// Adds --frames, --seconds and --quiet.
void addRunOptions(CLI::App& command, RunOptions& options);

} // namespace holdfast::app
