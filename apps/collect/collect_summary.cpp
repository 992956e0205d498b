#include "collect_summary.h"

#include "console.h"

#include <holdfast/patch/names.h>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <vector>

namespace holdfast::app {
namespace {

/// NaN of nothing.
double
mean(double sum, std::uint64_t count)
{
  return count > 0 ? sum / static_cast<double>(count) : kNoNumber;
}

} // namespace

void
CollectSummary::add(const CloudRow& cloud)
{
  ++clouds_;
  ++fingerprints_[cloud.fingerprint];
}

void
CollectSummary::add(const PatchRow& patch)
{
  ++patches_;
  Sums& sums = surfaces_.at(patch.surface);
  ++sums.patches;
  sums.points += patch.points;
  if (patch.chi2_expected > 0.0) {
    sums.chi2_ratio += patch.chi2 / patch.chi2_expected;
    ++sums.with_chi2;
  }
  if (patch.coverage == patch.coverage) {
    sums.coverage += static_cast<double>(patch.coverage);
    ++sums.with_coverage;
  }
}

void
CollectSummary::add(const FailedCloud& /*failed*/)
{
  ++failed_;
}

std::string
CollectSummary::table(const std::string& path, std::uint64_t bytes) const
{
  std::vector<std::vector<std::string>> rows{
      {"surface (means)", "patches", "points", "chi2/expected", "coverage"}};
  for (std::size_t i = 0; i < surfaces_.size(); ++i) {
    const Sums& sums = surfaces_[i];
    if (sums.patches == 0)
      continue;
    rows.push_back({std::string(kSurfaceNames.words[i]),
                    std::to_string(sums.patches),
                    formatNumber("%.0f", mean(sums.points, sums.patches)),
                    formatNumber("%.2f", mean(sums.chi2_ratio, sums.with_chi2)),
                    formatNumber("%.2f", mean(sums.coverage, sums.with_coverage))});
  }
  return fmt::format("{}: {} patches of {} clouds, {} clouds failed, {:.1f} MB\n",
                     path,
                     patches_,
                     clouds_,
                     failed_,
                     1e-6 * static_cast<double>(bytes)) +
         formatTable(rows);
}

std::string
CollectSummary::json(const std::string& path, std::uint64_t bytes) const
{
  using Json = nlohmann::ordered_json;
  Json surfaces = Json::object();
  for (std::size_t i = 0; i < surfaces_.size(); ++i) {
    const Sums& sums = surfaces_[i];
    if (sums.patches > 0)
      surfaces[std::string(kSurfaceNames.words[i])] = {
          {"patches", sums.patches},
          {"mean_points", mean(sums.points, sums.patches)},
          {"mean_chi2_over_expected", mean(sums.chi2_ratio, sums.with_chi2)},
          {"mean_coverage", mean(sums.coverage, sums.with_coverage)}};
  }
  const Json json = {{"file", path},
                     {"bytes", bytes},
                     {"clouds", clouds_},
                     {"failed", failed_},
                     {"patches", patches_},
                     {"surfaces", surfaces},
                     {"clouds_by_fingerprint", fingerprints_}};
  return json.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n";
}

} // namespace holdfast::app
