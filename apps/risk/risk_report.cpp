#include "risk/risk_report.h"

#include "io/input_json.h"
#include "io/json_parts.h"

#include <holdfast/contact/names.h>
#include <holdfast/patch/names.h>
#include <holdfast/patch/parameters.h>

#include <nlohmann/json.hpp>

#include <utility>

namespace holdfast::app {
namespace {

using Json = nlohmann::ordered_json; // NaN becomes null

Json
matrixJson(const JetMatrix& S)
{
  Json rows = Json::array();
  for (Eigen::Index i = 0; i < S.rows(); ++i)
    rows.push_back(io::vectorJson(S.row(i)));
  return rows;
}

Json
footJson(const Foot& foot)
{
  Json sole = Json::array();
  for (const Eigen::Vector2d& corner : foot.sole)
    sole.push_back(io::vectorJson(corner));
  const ContactTolerances& t = foot.tolerances;
  return {{"name", foot.name},
          {"sole_m", sole},
          {"reach_m", soleReach(foot)},
          {"area_m2", soleArea(foot)},
          {"curvature_per_m", io::vectorJson(foot.curvature)},
          {"ankle", kAnkleNames.of(foot.ankle)},
          {"friction", {{"mean", foot.friction.mean}, {"sigma", foot.friction.sigma}}},
          {"tolerances",
           {{"height_m", t.height_m},
            {"tilt_rad", foot.ankle == Ankle::Stiff ? Json(t.tilt_rad) : Json()},
            {"gap_m", t.gap_m},
            {"contact_m", t.contact_m},
            {"min_support", t.min_support}}}};
}

Json
eventsJson(const ContactEvents& risk)
{
  return {{"slip", risk.slip},
          {"height", risk.height},
          {"tilt", risk.tilt},
          {"gap", risk.gap},
          {"support", risk.support},
          {"total", risk.total},
          {"joint", risk.joint}};
}

Json
rankingJson(const FootholdRanking& ranking)
{
  return {{"candidates", ranking.candidates},
          {"footholds", ranking.footholds.size()},
          {"unseen", ranking.unseen},
          {"without_support", ranking.without_support},
          {"not_facing", ranking.not_facing},
          {"too_near", ranking.too_near},
          {"beyond_limit", ranking.beyond_limit},
          {"widest_support_m", ranking.widest_support_m}};
}

/// Surface and principal curvatures of a patch of the map; null where the map knows too
/// little.
void
addType(const PatchMap& map, std::uint64_t id, Json& json)
{
  const MapPatch* patch = map.find(id);
  const FitResult fit = patch != nullptr ? toFitResult(*patch) : FitResult();
  if (!isUsable(fit.status)) {
    json["type"] = json["kappa"] = nullptr;
    return;
  }
  json["type"] = kSurfaceNames.of(fit.patch.type.surface);
  json["kappa"] = io::vectorJson(fit.patch.principalCurvatures());
}

Json
footholdJson(const RiskReport& report, const Foothold& foothold)
{
  const ContactQuality& quality = *foothold.risk.quality;
  Json json{{"patch", foothold.patch},
            {"pose", io::poseJson(quality.pose, report.ground.offset)},
            {"pose_covariance", matrixJson(quality.pose_covariance)}};
  addType(report.ground.map, foothold.patch, json);
  json["risk"] = eventsJson(quality.risk);
  json["cvar_gap_m"] = quality.cvar_gap_m;
  json["contact_area_m2"] = quality.contact_area_m2;
  json["support_share"] = foothold.risk.support_share;
  json["yaw_rad"] = foothold.placement.yaw;
  json["views"] = foothold.views;
  json["last_seen"] = foothold.last_seen;
  return json;
}

/// A patch as it is drawn, and what came of it.
Json
patchJson(const RiskReport& report, const Foothold& tried)
{
  Json json{
      {"patch", tried.patch},
      {"status", kContactStatusNames.of(tried.risk.status)},
      {"total", tried.risk.quality ? Json(tried.risk.quality->risk.total) : Json()}};
  const FitResult fit = toFitResult(*report.ground.map.find(tried.patch));
  if (!isUsable(fit.status)) {
    json["surface"] = json["boundary"] = json["parameters"] = nullptr;
    return json;
  }
  ParameterVector parameters = pack(fit.patch);
  parameters.tail<3>() += report.ground.offset;
  json["surface"] = kSurfaceNames.of(fit.patch.type.surface);
  json["boundary"] = kBoundaryNames.of(fit.patch.type.boundary);
  json["parameters"] = io::vectorJson(parameters);
  return json;
}

/// convex_plane_decomposition_msgs/Polygon2d
Json
polygonJson(const PlanarOutline& outline)
{
  Json points = Json::array();
  for (const Eigen::Vector2d& p : outline)
    points.push_back({{"x", p.x()}, {"y", p.y()}});
  return {{"points", points}};
}

/// convex_plane_decomposition_msgs/PolygonWithHoles2d
Json
polygonWithHolesJson(const OutlineWithHoles& polygon)
{
  Json holes = Json::array();
  for (const PlanarOutline& hole : polygon.holes)
    holes.push_back(polygonJson(hole));
  return {{"outer_boundary", polygonJson(polygon.outer)}, {"holes", holes}};
}

/// convex_plane_decomposition_msgs/PlanarRegion, and the patch it is of.
Json
regionJson(const RiskReport& report, const PlanarRegion& region)
{
  const Eigen::Quaterniond q(region.pose.R);
  const Eigen::Vector3d c = region.pose.c + report.ground.offset;
  Json insets = Json::array();
  for (const OutlineWithHoles& inset : region.insets)
    insets.push_back(polygonWithHolesJson(inset));
  return {{"patch", region.patch},
          {"plane_parameters",
           {{"position", {{"x", c.x()}, {"y", c.y()}, {"z", c.z()}}},
            {"orientation", {{"x", q.x()}, {"y", q.y()}, {"z", q.z()}, {"w", q.w()}}}}},
          {"bbox2d",
           {{"min_x", region.low.x()},
            {"min_y", region.low.y()},
            {"max_x", region.high.x()},
            {"max_y", region.high.y()}}},
          {"boundary", polygonWithHolesJson(region.boundary)},
          {"insets", insets}};
}

/// File names need not be UTF-8; JSON must.
std::string
text(const Json& json)
{
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

/// "name": [ one in each line ]
template <typename Items, typename ToJson>
void
writeList(std::ostream& out,
          const char* name,
          const Items& items,
          const ToJson& to_json)
{
  out << ",\n\"" << name << "\": [";
  const char* before = "\n";
  for (const auto& item : items) {
    out << before << text(to_json(item));
    before = ",\n";
  }
  out << ']';
}

} // namespace

void
writeRiskJson(std::ostream& out, const RiskReport& report)
{
  Json assumptions = Json::array();
  for (const std::string_view assumption : kRiskAssumptions)
    assumptions.push_back(assumption);
  const Ground& ground = report.ground;
  Json head{{"source", report.source},
            {"frame", ground.is_map_file ? "map" : "cloud"},
            {"sensor", io::poseJson(ground.map.pose(), ground.offset)},
            {"offset", io::vectorJson(ground.offset)},
            {"radius_m", ground.radius_m},
            {"load_direction", io::vectorJson(report.options.load_direction)},
            {"foot", footJson(report.foot)},
            {"options",
             {{"yaws", report.options.yaws}, {"spacing_m", report.options.spacing_m}}},
            {"assumptions", assumptions},
            {"ranking", rankingJson(report.ranking)}};
  head["notices"] = ground.notices;
  if (ground.file) {
    head["input"] = io::inputJson(*ground.file);
    head["cloud_points"] = io::pointsJson(ground.points);
    head["sensor"]["viewpoint_credible"] = ground.viewpoint_is_credible;
  }
  std::string opening = text(head);
  opening.pop_back(); // the brace, for the lists to follow
  out << opening;
  writeList(out, "footholds", report.ranking.footholds, [&](const Foothold& foothold) {
    return footholdJson(report, foothold);
  });
  writeList(out, "patches", report.ranking.tried, [&](const Foothold& tried) {
    return patchJson(report, tried);
  });
  writeList(out, "planar_regions", report.regions, [&](const PlanarRegion& region) {
    return regionJson(report, region);
  });
  out << "}\n";
}

} // namespace holdfast::app
