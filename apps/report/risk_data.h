/// \file What `holdfast risk` has found, as data for the page.
#pragma once

#include "report/binary_block.h"
#include "report/report_result.h"

#include <nlohmann/json.hpp>

namespace holdfast::app {

/// Statuses of the patches one by one, footholds best first with their soles as
/// polygons, and what was asked; null for a result without a risk.
nlohmann::json riskJson(const ReportResult& result, BinaryBlock& block);

/// The colours of risks, for all results.
nlohmann::json riskScaleJson();

} // namespace holdfast::app
