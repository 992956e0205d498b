/// \file The result of a fit as a table for people.
#pragma once

#include <holdfast/io/patch_io.h>

#include <string>

namespace holdfast {

/// A heading, medians per surface type, and what was rejected. Sigma of the normal is
/// the rms angle between the fitted and the noise-free normal, sigma of the centre the
/// rms distance between the centres, both from the covariance.
std::string summaryTable(const PatchReport& report);

/// "too_few_points 12, degenerate 3".
std::string rejectedText(const std::map<FitStatus, int>& rejected);

} // namespace holdfast
