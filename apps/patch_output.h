/// \file The files that results are written to.
#pragma once

#include <holdfast/io/patch_io.h>

#include <string>

namespace holdfast::app {

/// Says early that a folder cannot be used, but does not create it yet.
/// \throw std::runtime_error "FOLDER: cause".
void checkFolder(const std::string& folder);

/// Makes the folder unless it is there. \throw std::runtime_error "FOLDER: cause".
void makeFolder(const std::string& folder);

/// Writes STEM.patches.json, .pcd and .ply, all or none; makes the folder if need be.
/// \throw std::runtime_error "PATH: cause".
void writePatchFiles(const PatchReport& report,
                     const std::string& folder,
                     const std::string& stem);

} // namespace holdfast::app
