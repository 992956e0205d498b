/// \file The page of a report without its data: page/dist/report.html.
#pragma once

#include <string_view>

namespace holdfast::app {

/// Stands where the data go.
inline constexpr std::string_view kDataMark = "holdfast-data-goes-here";

std::string_view pageTemplate();

} // namespace holdfast::app
