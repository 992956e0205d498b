/// \file What `experiment consistency` writes of its results.
#pragma once

#include "report.h"

#include <holdfast/evaluation/consistency.h>
#include <holdfast/patch/types.h>

#include <string>
#include <vector>

namespace holdfast::app {

/// What the row of a check is of.
struct CaseName {
  std::string scene, type, mode, options;
};

Json rowOf(const CaseName& name, PatchType type, const ConsistencyResult& result);

/// Where the state holds, by the two numbers that a fit reports: its nonlinearity and,
/// where a type has one, its curvature in sigmas.
std::vector<std::string> columnRemarks(const CaseName& name,
                                       const ConsistencyResult& result);

/// Adds the columns of checks of one patch, and what they mean.
void describePatches(int trials, bool shared_errors, Report& report);

/// Adds those of whole clouds.
void describeClouds(Report& report);

/// Null where nothing was counted.
Json value(const ErrorTally& tally, double ErrorTally::*member);

/// Gives all rows the same keys: null where they do not apply.
void completeRows(std::vector<Json>& rows);

} // namespace holdfast::app
