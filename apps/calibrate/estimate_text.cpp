#include "estimate_text.h"

#include "command_line.h"
#include "console.h"

#include <fmt/core.h>

#include <cmath>

namespace holdfast::app {

using Json = nlohmann::ordered_json;

std::string
digits(double value)
{
  return formatNumber("%#.3g", value);
}

double
rounded(double value)
{
  return parseNumber<double>(formatNumber("%.5g", value)).value_or(value);
}

std::string
valueText(const Estimate& estimate)
{
  return estimate.isKnown() ? digits(estimate.value) : "-";
}

std::string
intervalText(const Estimate& estimate)
{
  if (!std::isfinite(estimate.low))
    return "-";
  return digits(estimate.low) +
         (std::isinf(estimate.high) ? " or more" : " to " + digits(estimate.high));
}

std::string
valueAndInterval(const Estimate& estimate)
{
  return fmt::format("{} ({})", valueText(estimate), intervalText(estimate));
}

Json
estimateJson(const Estimate& estimate)
{
  if (!estimate.isKnown())
    return nullptr;
  Json interval;
  if (std::isfinite(estimate.low))
    interval = {estimate.low, estimate.high};
  return {{"value", estimate.value}, {"interval", interval}};
}

} // namespace holdfast::app
