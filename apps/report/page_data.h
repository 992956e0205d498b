/// \file What a report says, as data for its page.
#pragma once

#include "report/report_result.h"

#include <cstddef>
#include <string>
#include <vector>

namespace holdfast::app {

/// One JSON object in ASCII that can stand in a script element: no "<" in it.
/// \param points of all clouds together, at most.
std::string pageData(const std::vector<ReportResult>& results, std::size_t points);

/// The page: the template with the data in it.
/// \param max_bytes at most, unless patches alone take more; clouds are thinned for it.
std::string reportPage(const std::vector<ReportResult>& results, std::size_t max_bytes);

} // namespace holdfast::app
