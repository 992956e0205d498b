#include "risk_result.h"

#include "io/input_json.h"
#include "io/json_parts.h"

#include <holdfast/contact/names.h>
#include <holdfast/fit/options.h>
#include <holdfast/patch/names.h>
#include <holdfast/patch/parameters.h>

#include <algorithm>
#include <limits>
#include <set>
#include <stdexcept>
#include <utility>

namespace holdfast::app {
namespace {

using Json = nlohmann::json;

/// Degenerate where the map knows too little of it.
FitResult
fitFrom(const Json& json, const Eigen::Vector3d& offset)
{
  FitResult fit;
  fit.status = FitStatus::Degenerate;
  if (json.at("parameters").is_null())
    return fit;
  const auto surface = kSurfaceNames.find(json.at("surface").get<std::string>());
  const auto boundary = kBoundaryNames.find(json.at("boundary").get<std::string>());
  if (!surface || !boundary || !isLegal({*surface, *boundary}))
    throw std::runtime_error("has a patch of unknown type");
  const Json& numbers = json.at("parameters");
  const PatchType type{*surface, *boundary};
  if (!numbers.is_array() || static_cast<int>(numbers.size()) != degreesOfFreedom(type))
    throw std::runtime_error("has a patch of the wrong number of parameters");
  ParameterVector parameters(static_cast<Eigen::Index>(numbers.size()));
  for (std::size_t i = 0; i < numbers.size(); ++i)
    parameters[static_cast<Eigen::Index>(i)] = numbers[i].get<double>();
  parameters.tail<3>() -= offset;
  fit.patch = unpack(type, parameters);
  if (const std::string error = validityError(fit.patch); !error.empty())
    throw std::runtime_error("has an impossible patch: " + error);
  fit.state = toState(fit.patch, FitOptions().containment);
  fit.status = FitStatus::Converged;
  return fit;
}

TriedPatch
triedFrom(const Json& json, const RiskResult& result)
{
  TriedPatch tried;
  tried.id = json.at("patch").get<std::uint64_t>();
  const auto status = kContactStatusNames.find(json.at("status").get<std::string>());
  if (!status)
    throw std::runtime_error("has a patch of unknown status");
  tried.status = *status;
  if (!json.at("total").is_null())
    tried.total = json.at("total").get<double>();
  tried.patch.fit = fitFrom(json, result.offset);
  tried.patch.radius_m = result.radius_m;
  return tried;
}

/// NaN where it is not there or null.
double
numberFrom(const Json& json, const char* name)
{
  const auto at = json.find(name);
  return at != json.end() && at->is_number() ? at->get<double>() :
                                               std::numeric_limits<double>::quiet_NaN();
}

Foothold
footholdFrom(const Json& json, const Eigen::Vector3d& offset)
{
  Foothold foothold;
  foothold.patch = json.at("patch").get<std::uint64_t>();
  foothold.placement.yaw = numberFrom(json, "yaw_rad");
  foothold.views = json.value("views", 0);
  foothold.last_seen = json.value("last_seen", 0);
  foothold.risk.status = ContactStatus::Ok;
  foothold.risk.support_share = numberFrom(json, "support_share");
  ContactQuality quality;
  quality.pose = io::poseFromJson(json.at("pose"), offset);
  const Json& risk = json.at("risk");
  ContactEvents& events = quality.risk;
  events.total = risk.at("total").get<double>();
  events.slip = numberFrom(risk, "slip");
  events.height = numberFrom(risk, "height");
  events.tilt = numberFrom(risk, "tilt");
  events.gap = numberFrom(risk, "gap");
  events.support = numberFrom(risk, "support");
  events.joint = numberFrom(risk, "joint");
  quality.cvar_gap_m = numberFrom(json, "cvar_gap_m");
  quality.contact_area_m2 = numberFrom(json, "contact_area_m2");
  foothold.placement.point = quality.pose.c;
  foothold.risk.quality = quality;
  return foothold;
}

PictureSole
soleOf(const Foothold& foothold, const std::vector<Eigen::Vector2d>& corners)
{
  const ContactQuality& quality = *foothold.risk.quality;
  const auto& [R, c] = quality.pose;
  PictureSole sole;
  double reach = 0.0;
  for (const Eigen::Vector2d& corner : corners) {
    sole.corners.emplace_back(c + R.leftCols<2>() * corner);
    sole.middle += sole.corners.back() / static_cast<double>(corners.size());
    reach = std::max(reach, corner.x());
  }
  sole.normal = R.col(2);
  sole.toe = c + reach * R.col(0);
  sole.total = quality.risk.total;
  return sole;
}

/// There is something to draw, and every foothold is on some of it.
void
requireWhole(const RiskResult& result)
{
  std::set<std::uint64_t> ids;
  bool any = false;
  for (const TriedPatch& tried : result.patches) {
    ids.insert(tried.id);
    any = any || isUsable(tried.patch.fit.status);
  }
  if (!any)
    throw std::runtime_error("has no patch");
  for (const Foothold& foothold : result.footholds)
    if (ids.count(foothold.patch) == 0)
      throw std::runtime_error("has a foothold on a patch that is not in it");
}

RiskResult
resultFrom(Json json)
{
  RiskResult result;
  result.source = json.at("source").get<std::string>();
  result.is_of_map = json.at("frame").get<std::string>() == "map";
  result.offset = io::vectorFromJson<3>(json.at("offset"));
  result.sensor_pose = io::poseFromJson(json.at("sensor"), result.offset);
  if (const auto input = json.find("input"); input != json.end())
    result.file = io::inputFromJson(*input);
  result.radius_m = json.value("radius_m", 0.0);
  for (const Json& tried : json.at("patches"))
    result.patches.push_back(triedFrom(tried, result));
  std::vector<Eigen::Vector2d> corners;
  for (const Json& corner : json.at("foot").at("sole_m"))
    corners.emplace_back(io::vectorFromJson<2>(corner));
  if (corners.size() < 3)
    throw std::runtime_error("has a sole of fewer than three corners");
  for (const Json& foothold : json.at("footholds")) {
    result.footholds.push_back(footholdFrom(foothold, result.offset));
    result.soles.push_back(soleOf(result.footholds.back(), corners));
  }
  requireWhole(result);
  for (const char* list : {"patches", "footholds", "planar_regions"})
    json.erase(list);
  result.head = std::move(json);
  return result;
}

} // namespace

bool
isRiskResult(const std::string& text)
{
  return text.find("\"footholds\":") != std::string::npos;
}

RiskResult
readRiskResult(const std::string& text)
{
  Json json;
  try {
    json = Json::parse(text);
  }
  catch (const Json::exception& error) {
    throw std::runtime_error(std::string("is not JSON: ") + error.what());
  }
  try {
    return resultFrom(std::move(json));
  }
  catch (const Json::exception& error) {
    throw std::runtime_error(std::string("is no result of 'holdfast risk': ") +
                             error.what());
  }
}

} // namespace holdfast::app
