#include "cloud_limits.h"

#include <optional>

namespace holdfast::app {
namespace {

struct VariedLimit {
  const char* name;
  std::optional<double> ValidationOptions::*limit;
  double tight, loose; ///< factors on the default
};

// Half and double, but where that is beyond what there is to measure.
constexpr VariedLimit kVaried[] = {
    {"max_extent", &ValidationOptions::max_extent, 0.8, 2.0},
    {"max_sagitta", &ValidationOptions::max_sagitta, 0.5, 2.0},
    {"max_bend", &ValidationOptions::max_bend, 0.5, 2.0},
    {"max_departure", &ValidationOptions::max_departure, 0.5, 2.0},
    {"max_noise", &ValidationOptions::max_noise, 0.5, 2.0},
    {"max_stray", &ValidationOptions::max_stray, 0.5, 2.0},
    {"max_view_angle_rad", &ValidationOptions::max_view_angle_rad, 0.5, 0.8},
    {"min_coverage", &ValidationOptions::min_coverage, 1.5, 0.5},
    {"max_chi2_per_dof", &ValidationOptions::max_chi2_per_dof, 0.5, 2.0}};

LimitSet
setOf(const VariedLimit& varied, std::optional<double> value)
{
  LimitSet set{varied.name, value ? Json(*value) : Json(), {}};
  set.options.*varied.limit = value;
  return set;
}

} // namespace

std::vector<LimitSet>
limitSets()
{
  std::vector<LimitSet> sets{{"defaults", Json(), {}}};
  for (const VariedLimit& varied : kVaried) {
    const double usual = (ValidationOptions().*varied.limit).value();
    sets.push_back(setOf(varied, varied.tight * usual));
    sets.push_back(setOf(varied, varied.loose * usual));
    sets.push_back(setOf(varied, std::nullopt));
  }
  sets.push_back({"none", Json(), ValidationOptions::withoutLimits()});
  return sets;
}

std::vector<ValidationOptions>
optionsOf(const std::vector<LimitSet>& sets)
{
  std::vector<ValidationOptions> options;
  for (const LimitSet& set : sets)
    options.push_back(set.options);
  return options;
}

Json
limitRow(const LimitSet& set, const CloudCheck& check)
{
  const Json all = summaryOf(check);
  Json row = {{"limit", set.limit}, {"value", set.value}};
  for (const char* key : {"radius_m",
                          "type",
                          "trials",
                          "seeds",
                          "patches",
                          "far",
                          "other_type",
                          "state_nees_per_dof",
                          "state_coverage95",
                          "surface_nees_per_dof",
                          "surface_coverage95",
                          "over_edge",
                          "covered"})
    row[key] = all[key];
  row["accepted_rate"] = check.seeds > 0 ?
                             Json(static_cast<double>(check.accepted) / check.seeds) :
                             Json();
  return row;
}

void
describeLimits(Report& report)
{
  report.columns = {{"scene", "scene"},
                    {"mode", "mode"},
                    {"options", "options"},
                    {"radius", "radius_m"},
                    {"limit", "limit"},
                    {"at", "value"},
                    {"accepted", "accepted_rate"},
                    {"judged", "patches"},
                    {"far", "far"},
                    {"state NEES/dof", "state_nees_per_dof"},
                    {"95 %", "state_coverage95"},
                    {"surface", "surface_nees_per_dof"},
                    {"95 %", "surface_coverage95"},
                    {"over an edge", "over_edge"},
                    {"covered", "covered"}};
  report.remarks.push_back(
      "Selection is a bias: the same fits under the default limits, under those with "
      "one limit changed (at: its value; -: off), and under none. accepted: share of "
      "the seeds with a patch. judged, far, state, surface, over an edge, covered: as "
      "without --limits, of the accepted patches. What a limit selects by the noise "
      "shows as NEES/dof that moves with it.");
}

} // namespace holdfast::app
