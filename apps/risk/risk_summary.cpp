#include "risk/risk_summary.h"

#include "console.h"

#include <holdfast/geometry/constants.h>
#include <holdfast/patch/types.h>

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace holdfast::app {
namespace {

/// The load that most patches face: against their mean normal.
Eigen::Vector3d
facedLoad(const PatchMap& map)
{
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const MapPatch& patch : map.patches())
    sum -= patch.anchor.R.col(2);
  return sum.normalized();
}

/// A line where most patches face another load than the one that was taken, as level
/// ground does where a camera looks down at it and its own frame's axis was taken.
std::string
facingHint(const RiskReport& report)
{
  constexpr double kFar = 0.35; // rad; a slope as steep is for climbing
  const Eigen::Vector3d faced = facedLoad(report.ground.map);
  const Eigen::Vector3d taken = report.options.load_direction.stableNormalized();
  const double angle = std::atan2(faced.cross(taken).norm(), faced.dot(taken));
  if (!(angle > kFar))
    return "";
  return fmt::format(
      "Most patches face a load along {}, {:.0f} degrees from this one.\n",
      vectorText(faced),
      angle * 180.0 / kPi);
}

/// Probabilities as people read them.
std::string
percent(double probability)
{
  const double p = 100.0 * probability;
  return p > 0.0 && p < 0.01 ? "<0.01" : fmt::format("{:.2f}", p);
}

std::vector<std::string>
rowOf(const RiskReport& report, std::size_t rank)
{
  const Foothold& foothold = report.ranking.footholds[rank];
  const ContactQuality& quality = *foothold.risk.quality;
  const ContactEvents& risk = quality.risk;
  const Eigen::Vector3d p = foothold.placement.point + report.ground.offset;
  const FitResult fit = toFitResult(*report.ground.map.find(foothold.patch));
  return {fmt::format("{}", rank + 1),
          fmt::format("{:.3f} {:.3f} {:.3f}", p.x(), p.y(), p.z()),
          fmt::format("{:.0f}", foothold.placement.yaw * 180.0 / kPi),
          isUsable(fit.status) ? std::string(surfaceName(fit.patch.type.surface)) : "-",
          percent(risk.total),
          percent(risk.slip),
          percent(risk.height),
          percent(risk.tilt),
          percent(risk.gap),
          percent(risk.support),
          fmt::format("{:.1f}", 1e3 * quality.cvar_gap_m),
          fmt::format("{:.1f}", 1e4 * quality.contact_area_m2),
          fmt::format("{}", foothold.views)};
}

} // namespace

std::string
vectorText(const Eigen::Vector3d& v)
{
  const auto word = [](double x) { // -0.00 is 0
    return fmt::format("{:.3g}", std::abs(x) < 5e-4 ? 0.0 : x);
  };
  return word(v.x()) + " " + word(v.y()) + " " + word(v.z());
}

std::string
causeOfNone(const RiskReport& report)
{
  const FootholdRanking& r = report.ranking;
  if (!r.footholds.empty())
    return "";
  if (r.candidates == 0 && report.ground.is_map_file)
    return "there is no patch to step on";
  if (r.candidates == 0)
    return fmt::format("no patch of a radius of {:.3f} m fits this cloud; --radius "
                       "takes others, where the sole reaches {:.3f} m",
                       report.ground.radius_m,
                       soleReach(report.foot));
  if (r.unseen == r.candidates)
    return "the map tells of none of its patches where it was seen (no support grids), "
           "and without that there is no risk";
  if (r.not_facing > r.without_support)
    return fmt::format("no patch faces a load along {}; most face one along {}: "
                       "--load-direction {}",
                       vectorText(report.options.load_direction),
                       vectorText(facedLoad(report.ground.map)),
                       vectorText(facedLoad(report.ground.map)));
  const double reach = soleReach(report.foot);
  // Patches are seen a little less far than their radius, at least.
  const double wanted = std::max(1.1 * reach, 1.1 * report.ground.radius_m);
  return fmt::format("the sole reaches {:.3f} m and the patches of this map {:.3f} m: "
                     "{} with --radius {:.3f}",
                     reach,
                     r.widest_support_m,
                     report.ground.is_map_file ? "make the map" : "try",
                     wanted);
}

std::string
riskTable(const RiskReport& report)
{
  constexpr std::size_t kShown = 10;
  const FootholdRanking& r = report.ranking;
  std::vector<std::vector<std::string>> table{{"",
                                               "x y z m",
                                               "yaw deg",
                                               "surface",
                                               "total %",
                                               "slip",
                                               "height",
                                               "tilt",
                                               "gap",
                                               "support",
                                               "cvar gap mm",
                                               "contact cm2",
                                               "views"}};
  for (std::size_t i = 0; i < std::min(kShown, r.footholds.size()); ++i)
    table.push_back(rowOf(report, i));
  std::string text = fmt::format("{}: {} on {} patches, load along {}\n{}",
                                 report.source,
                                 report.foot.name,
                                 r.candidates,
                                 vectorText(report.options.load_direction),
                                 formatTable(table));
  text += fmt::format("{} footholds", r.footholds.size());
  const std::pair<int, const char*> parts[] = {
      {r.without_support, "without enough support"},
      {r.not_facing, "not facing the load"},
      {r.unseen, "seen nowhere"},
      {r.too_near, "nearer to a better one than the spacing"},
      {r.beyond_limit, "beyond --best"}};
  for (const auto& [count, what] : parts)
    if (count > 0)
      text += fmt::format(", {} {}", count, what);
  return text + "\n" + facingHint(report);
}

} // namespace holdfast::app
