/// \file A map in words and a table for people.
#pragma once

#include <holdfast/pcl/frame_mapping.h>

#include <string>
#include <vector>

namespace holdfast::app {

/// "frame.pcd: 310 measured: 280 fused, 22 born, ...; 31 ms".
std::string frameLine(const std::string& frame,
                      const FrameReport& report,
                      std::size_t patches,
                      double milliseconds);

/// Patches by type, and by number of independent views with their median sigmas.
/// \param single_sigmas_m of the heights of single views, for comparison.
std::string mapTable(const PatchMap& map,
                     const std::vector<FitResult>& fits,
                     std::vector<double> single_sigmas_m);

} // namespace holdfast::app
