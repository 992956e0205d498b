/// \file What the module holdfast_comparison exports.
#pragma once

#include "experiment/experiment.h"

/// Side by side with PCL: the same noisy points to our models and to PCL's own.
extern "C" void holdfastCompareWithPcl(
    const holdfast::app::ExperimentSettings& settings,
    holdfast::app::Report& report);
