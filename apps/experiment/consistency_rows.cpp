#include "consistency_rows.h"

#include "console.h"

#include <algorithm>
#include <cmath>

namespace holdfast::app {
namespace {

Json
byName(const std::vector<double>& values, PatchType type)
{
  Json json = Json::object();
  const std::vector<std::string> names = parameterNames(type);
  for (std::size_t i = 0; i < values.size(); ++i)
    json[names[i]] = values[i];
  return json;
}

double
largest(const std::vector<double>& values)
{
  double result = 0.0;
  for (const double value : values)
    result = std::max(result, std::abs(value));
  return result;
}

Json
columnsJson(const std::vector<ConsistencyColumn>& columns)
{
  Json json = Json::array();
  for (const ConsistencyColumn& column : columns)
    json.push_back(
        {{"up_to", std::isfinite(column.up_to) ? Json(column.up_to) : Json()},
         {"trials", column.state.count},
         {"state_nees_per_dof", column.state.nees_per_dof},
         {"state_coverage95", column.state.coverage95},
         {"nees_per_dof", column.parameters.nees_per_dof}});
  return json;
}

// "up to 3: 8.1 (54.2 %, 120 fits)" and so on, where there are any.
std::string
columnsText(const std::vector<ConsistencyColumn>& columns)
{
  std::string text;
  for (const ConsistencyColumn& column : columns)
    if (column.state.count > 0)
      text +=
          (text.empty() ? "" : "; ") +
          (std::isfinite(column.up_to) ? "up to " + formatNumber("%g", column.up_to) :
                                         std::string("above")) +
          ": " + formatNumber("%.3g", column.state.nees_per_dof) + " (" +
          formatNumber("%.1f", 100.0 * column.state.coverage95) + " %, " +
          std::to_string(column.state.count) + " fits)";
  return text;
}

} // namespace

Json
value(const ErrorTally& tally, double ErrorTally::*member)
{
  return tally.count > 0 ? Json(tally.*member) : Json();
}

Json
rowOf(const CaseName& name, PatchType type, const ConsistencyResult& result)
{
  const auto range =
      std::minmax_element(result.sigma_ratio.begin(), result.sigma_ratio.end());
  const bool any = !result.sigma_ratio.empty();
  const auto nees = &ErrorTally::nees_per_dof, within = &ErrorTally::coverage95;
  return {{"scene", name.scene},
          {"type", name.type},
          {"mode", name.mode},
          {"options", name.options},
          {"trials", result.trials},
          {"points", result.points},
          {"nees_per_dof", result.nees_per_dof},
          {"nees_per_dof_about_mean", result.nees_per_dof_about_mean},
          {"coverage95", result.coverage95},
          {"sigma_ratio_min", any ? Json(*range.first) : Json()},
          {"sigma_ratio_max", any ? Json(*range.second) : Json()},
          {"bias_after_shift_max", largest(result.bias_after_shift_sigma)},
          {"state_nees_per_dof", result.state_nees_per_dof},
          {"state_coverage95", result.state_coverage95},
          {"unflagged_nees_per_dof", result.unflagged_nees_per_dof},
          {"unflagged_rate", result.unflagged_rate},
          {"unflagged_state_nees_per_dof", value(result.unflagged_state, nees)},
          {"unflagged_state_coverage95", value(result.unflagged_state, within)},
          {"flagged_state_nees_per_dof", value(result.flagged_state, nees)},
          {"flagged_state_coverage95", value(result.flagged_state, within)},
          {"surface_nees_per_dof", value(result.parts.surface, nees)},
          {"surface_coverage95", value(result.parts.surface, within)},
          {"moments_nees_per_dof", value(result.parts.moments, nees)},
          {"curvature_nees_per_dof", value(result.parts.curvature, nees)},
          {"normal_nees_per_dof", value(result.parts.normal, nees)},
          {"centre_nees_per_dof", value(result.parts.centre, nees)},
          {"by_nonlinearity", columnsJson(result.by_nonlinearity)},
          {"by_curvature", columnsJson(result.by_curvature)},
          {"type_error_rate",
           isParaboloid(type.surface) || (type.surface == SurfaceType::Plane &&
                                          type.boundary == BoundaryType::Ellipse) ?
               Json(result.type_error_rate) :
               Json()},
          {"sigma_ratio", byName(result.sigma_ratio, type)},
          {"bias_sigma", byName(result.bias_sigma, type)},
          {"bias_after_shift_sigma", byName(result.bias_after_shift_sigma, type)},
          {"switch_rate", result.switch_rate},
          {"failure_rate", result.failure_rate}};
}

std::vector<std::string>
columnRemarks(const CaseName& name, const ConsistencyResult& result)
{
  const std::string what = name.scene + ", " + name.type + " (" + name.mode + ", " +
                           name.options +
                           "): state NEES/dof and share within 95 %, by ";
  std::vector<std::string> remarks{what + "nonlinearity " +
                                   columnsText(result.by_nonlinearity)};
  if (!result.by_curvature.empty())
    remarks.push_back(what + "|kappa| in sigmas " + columnsText(result.by_curvature));
  return remarks;
}

void
completeRows(std::vector<Json>& rows)
{
  Json all = Json::object();
  for (const Json& row : rows)
    for (const auto& item : row.items())
      all[item.key()] = nullptr;
  for (Json& row : rows) {
    Json complete = all;
    complete.update(row);
    row = std::move(complete);
  }
}

} // namespace holdfast::app
