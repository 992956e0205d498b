#include "consistency_rows.h"

#include <fmt/core.h>

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
      text += fmt::format("{}{}: {:.3g} ({:.1f} %, {} fits)",
                          text.empty() ? "" : "; ",
                          std::isfinite(column.up_to) ?
                              fmt::format("up to {:g}", column.up_to) :
                              "above",
                          column.state.nees_per_dof,
                          100.0 * column.state.coverage95,
                          column.state.count);
  return text;
}

// Of the state, as checks of one patch and of whole clouds have it.
const std::vector<Column> kStateColumns{{"state NEES/dof", "state_nees_per_dof"},
                                        {"state 95 %", "state_coverage95"},
                                        {"no flag", "unflagged_state_nees_per_dof"},
                                        {"95 %", "unflagged_state_coverage95"},
                                        {"flag", "flagged_state_nees_per_dof"},
                                        {"95 %", "flagged_state_coverage95"},
                                        {"surface", "surface_nees_per_dof"},
                                        {"95 %", "surface_coverage95"}};

void
addColumns(const std::vector<Column>& columns, Report& report)
{
  report.columns.insert(report.columns.end(), columns.begin(), columns.end());
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
  const std::string what =
      fmt::format("{}, {} ({}, {}): state NEES/dof and share within 95 %, by ",
                  name.scene,
                  name.type,
                  name.mode,
                  name.options);
  std::vector<std::string> remarks{what + "nonlinearity " +
                                   columnsText(result.by_nonlinearity)};
  if (!result.by_curvature.empty())
    remarks.push_back(what + "|kappa| in sigmas " + columnsText(result.by_curvature));
  return remarks;
}

void
describePatches(int trials, bool shared_errors, Report& report)
{
  addColumns({{"N", "points"}}, report);
  addColumns(kStateColumns, report);
  addColumns({{"unflagged", "unflagged_nees_per_dof"},
              {"share", "unflagged_rate"},
              {"NEES/dof", "nees_per_dof"},
              {"about mean", "nees_per_dof_about_mean"},
              {"95 %", "coverage95"},
              {"sigma min", "sigma_ratio_min"},
              {"sigma max", "sigma_ratio_max"},
              {"bias", "bias_after_shift_max"},
              {"type errors", "type_error_rate"},
              {"failures", "failure_rate"}},
             report);
  report.remarks.push_back(
      "NEES/dof: squared error about the noise-free fit, normalised by the predicted "
      "covariance; 1 is right, and a Monte Carlo of this size gives it to about +-" +
      std::to_string(std::sqrt(2.0 / (7.0 * trials))).substr(0, 5) +
      " (one sigma). 95 %: share within the predicted ellipsoid; behind flag and no "
      "flag: of the state of those fits. surface: normal and height alone. unflagged, "
      "share: parameters where no flag "
      "is set. sigma: predicted over empirical. bias: largest of any parameter in "
      "sigmas, second-order shift subtracted.");
  if (shared_errors)
    report.remarks.push_back(
        "Errors that neighbours share do not average away, what is a point's own does: "
        "the parts of the state move together, along a line that bends, and the whole "
        "is too sure where many points meet strong noise. Each part alone: surface, "
        "and moments_, curvature_, normal_ and centre_nees_per_dof in the files.");
}

void
describeClouds(Report& report)
{
  addColumns({{"radius", "radius_m"},
              {"frames", "trials"},
              {"N", "points"},
              {"judged", "patches"},
              {"far", "far"}},
             report);
  addColumns(kStateColumns, report);
  addColumns({{"unflagged", "unflagged_nees_per_dof"},
              {"95 %", "unflagged_coverage95"},
              {"flagged", "flagged"},
              {"switched", "switch_rate"},
              {"other type", "other_type"},
              {"no reference", "no_reference"},
              {"failures", "failure_rate"},
              {"over an edge", "over_edge"},
              {"covered", "covered"}},
             report);
  report.remarks.push_back(
      "Whole clouds: every accepted patch about the fit to the same pixels without "
      "noise, under the same covariances. far: those more than ten sigmas off, at "
      "another minimum where the surface misfits, counted as outside of the ellipsoid, "
      "but left out of the means. surface: normal and height. unflagged: parameters "
      "where no flag is set, flagged: how many have one, switched: share of those "
      "without whose axes came out turned by more than 45 degrees, left out. other "
      "type: the noise-free points choose another one; selection of the type is in no "
      "covariance, and these are not judged. no reference: the noise-free points "
      "determine no patch. over an edge: share of the accepted patches that leave the "
      "true surface by more than four sigmas of a point in a twentieth of their area. "
      "covered: share of the smooth surface that lies on one. Patches that overlap "
      "share errors, so that a frame tells "
      "less than its number of patches.");
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
