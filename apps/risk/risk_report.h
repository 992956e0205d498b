/// \file What a run of `holdfast risk` has found, and its JSON.
#pragma once

#include "risk/risk_input.h"

#include <holdfast/contact/foothold.h>
#include <holdfast/contact/planar_region.h>

#include <ostream>
#include <string>

namespace holdfast::app {

struct RiskReport {
  std::string source; ///< file
  Ground ground;
  Foot foot;
  FootholdOptions options;
  FootholdRanking ranking;
  std::vector<PlanarRegion> regions;
};

/// One object (doc/risk.md explains it), a foothold or patch in each line. Numbers
/// that nobody knows are null.
void writeRiskJson(std::ostream& out, const RiskReport& report);

} // namespace holdfast::app
