/// \file Layers of a risk grid as files.
#pragma once

#include "render/canvas.h"

#include <holdfast/contact/risk_grid.h>

#include <ostream>
#include <string>

namespace holdfast::app {

/// True for *.png, *.pcd and *.tif.
bool isLayerFile(const std::string& path);

/// Writes the file that its ending says: a picture of the total risk as seen against
/// the load, x up and y to the left; or the cells with all layers as fields, organized,
/// in the frame of the map; or a TIFF of one page of 32-bit floats for each layer, its
/// name as ImageDescription.
/// \param offset of the map's frame in that of the file, added to the points of a PCD.
/// \throw std::runtime_error "PATH: cause".
void writeLayers(const std::string& path,
                 const RiskGrid& grid,
                 const Eigen::Vector3d& offset);

/// Pages of 32-bit floats, one for each layer, its rows those of the grid.
void writeTiff(std::ostream& out, const RiskGrid& grid);

} // namespace holdfast::app
