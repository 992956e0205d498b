/// \file Patches and clouds on streams, one line each, as PCL's points and clouds are.
#pragma once

#include <holdfast/pcl/patch_extraction.h>
#include <holdfast/pcl/point_types.h>

#include <iosfwd>

namespace holdfast {

/// "circular_cylinder rectangle at (0.12, -0.03, 1.05) m, normal (0, 0.1, -0.99),
/// curvatures (0, 12.5) /m". Numbers as the stream is set, but in the C locale.
std::ostream& operator<<(std::ostream& out, const Patch& patch);

/// The patch, how sure it is (sigma along the normal, m) and how good: chi-square over
/// what it should be and the number of points; what is no patch by its reason.
std::ostream& operator<<(std::ostream& out, const ExtractedPatch& patch);

/// As an ExtractedPatch; one of no known type is said to be that.
std::ostream& operator<<(std::ostream& out, const PatchPoint& point);

/// "52 patches of 47000 points by kinect_v1; 3 seeds without: too_few_points 3; ...".
std::ostream& operator<<(std::ostream& out, const ExtractionResult& result);

/// "640 x 480 points, organized, 290112 valid, with covariances, seen from (0, 0, 0)".
std::ostream& operator<<(std::ostream& out, const RangeCloud& cloud);

} // namespace holdfast
