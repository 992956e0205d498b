/// \file The result of a fit in numbers and a table for people.
#pragma once

#include <holdfast/io/patch_io.h>

#include <string>

namespace holdfast::app {

/// normalSigma() and centreSigma() in the units that people read.
double normalSigmaDegrees(const FitResult& fit);
double centreSigmaMillimetres(const FitResult& fit);

/// A heading, medians per surface type, and what was rejected.
std::string summaryTable(const PatchReport& report);

/// "too_few_points 12, degenerate 3, coverage_too_low 8".
std::string rejectedText(const ExtractionResult& result);

} // namespace holdfast::app
