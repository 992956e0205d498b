/// \file Patches and their uncertainty as glTF, for other viewers.
#pragma once

#include "report/report_result.h"

#include <string>
#include <vector>

namespace holdfast::app {

/// A binary glTF 2.0 file: for each result a node with the patches, one mesh of a
/// primitive per type of surface, a node with the ellipsoids of the centres at three
/// sigma where they are known, and of a risk one with the soles of its footholds. y is
/// up, as glTF has it. \param magnification of the ellipsoids, which the name of their
/// node says. \throw std::runtime_error when no patch has a shape.
std::string toGlb(const std::vector<ReportResult>& results, double magnification);

} // namespace holdfast::app
