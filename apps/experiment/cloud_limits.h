/// \file What each limit of acceptance does to the accepted patches, for `experiment
/// consistency --limits`.
#pragma once

#include "report.h"
#include "whole_cloud.h"

#include <holdfast/validation/checks.h>

#include <string>
#include <vector>

namespace holdfast::app {

/// The defaults, but for one limit.
struct LimitSet {
  std::string limit; ///< its name; "defaults" and "none" are of all
  Json value; ///< its value; null where it is off
  ValidationOptions options;
};

/// The defaults, each limit tightened, loosened and off, and all off.
std::vector<LimitSet> limitSets();

std::vector<ValidationOptions> optionsOf(const std::vector<LimitSet>& sets);

/// \param check under the limits of the set.
Json limitRow(const LimitSet& set, const CloudCheck& check);

/// Adds the columns and what they mean.
void describeLimits(Report& report);

} // namespace holdfast::app
