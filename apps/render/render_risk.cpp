#include "render_risk.h"

#include "risk_colors.h"

#include <holdfast/patch/names.h>
#include <holdfast/patch/parameters.h>

#include <Eigen/Geometry>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <optional>
#include <stdexcept>

namespace holdfast::app {
namespace {

using Json = nlohmann::json;

template <int n>
Eigen::Matrix<double, n, 1>
vectorFrom(const Json& json)
{
  if (!json.is_array() || json.size() != n)
    throw std::runtime_error("has a vector of another length than " +
                             std::to_string(n));
  Eigen::Matrix<double, n, 1> v;
  for (int i = 0; i < n; ++i)
    v[i] = json.at(static_cast<std::size_t>(i)).get<double>();
  if (!v.allFinite())
    throw std::runtime_error("has a vector that is not finite");
  return v;
}

/// Nothing where the map knows too little of it.
std::optional<ExtractedPatch>
patchFrom(const Json& json, const Eigen::Vector3d& offset)
{
  if (json.at("parameters").is_null())
    return std::nullopt;
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
  ExtractedPatch patch;
  patch.fit.patch = unpack(type, parameters);
  if (const std::string error = validityError(patch.fit.patch); !error.empty())
    throw std::runtime_error("has an impossible patch: " + error);
  return patch;
}

PictureSole
soleFrom(const Json& json,
         const std::vector<Eigen::Vector2d>& corners,
         const Eigen::Vector3d& offset)
{
  const Json& pose = json.at("pose");
  const Eigen::Vector4d q = vectorFrom<4>(pose.at("orientation_wxyz"));
  if (!(q.norm() > 0.5))
    throw std::runtime_error("has a foothold without orientation");
  const Eigen::Matrix3d R =
      Eigen::Quaterniond(q[0], q[1], q[2], q[3]).normalized().toRotationMatrix();
  const Eigen::Vector3d c = vectorFrom<3>(pose.at("position")) - offset;
  PictureSole sole;
  double reach = 0.0;
  for (const Eigen::Vector2d& corner : corners) {
    sole.corners.emplace_back(c + R.leftCols<2>() * corner);
    reach = std::max(reach, corner.x());
  }
  sole.normal = R.col(2);
  sole.toe = c + reach * R.col(0);
  sole.total = json.at("risk").at("total").get<double>();
  return sole;
}

void
drawRing(Canvas& canvas,
         const std::vector<ScreenPoint>& points,
         double width,
         const Rgb& color)
{
  for (std::size_t i = 0; i < points.size(); ++i)
    canvas.drawLine(points[i], points[(i + 1) % points.size()], width, color);
}

RiskPicture
pictureFrom(const Json& json)
{
  RiskPicture picture;
  picture.source = json.at("source").get<std::string>();
  picture.is_of_map = json.at("frame").get<std::string>() == "map";
  const Eigen::Vector3d offset = vectorFrom<3>(json.at("offset"));
  for (const Json& tried : json.at("patches"))
    if (auto patch = patchFrom(tried, offset)) {
      const Json& total = tried.at("total");
      picture.patches.push_back(std::move(*patch));
      picture.colors.push_back(total.is_null() ? kNoSupport :
                                                 riskColor(total.get<double>()));
    }
  std::vector<Eigen::Vector2d> corners;
  for (const Json& corner : json.at("foot").at("sole_m"))
    corners.emplace_back(vectorFrom<2>(corner));
  for (const Json& foothold : json.at("footholds"))
    picture.soles.push_back(soleFrom(foothold, corners, offset));
  if (picture.patches.empty())
    throw std::runtime_error("has no patch");
  return picture;
}

} // namespace

RiskPicture
readRisk(const std::string& text)
{
  Json json;
  try {
    json = Json::parse(text);
  }
  catch (const Json::exception& error) {
    throw std::runtime_error(std::string("is no JSON: ") + error.what());
  }
  if (!json.is_object() || !json.contains("footholds"))
    throw std::runtime_error("is no result of 'holdfast risk', which --color risk "
                             "shows");
  try {
    return pictureFrom(json);
  }
  catch (const Json::exception& error) {
    throw std::runtime_error(std::string("is no result of 'holdfast risk': ") +
                             error.what());
  }
}

void
drawSole(Canvas& canvas, const View& view, const PictureSole& sole)
{
  constexpr double kAbove = 0.015; // m: not hidden by the points it stands on
  constexpr double kWidth = 2.0, kHalo = 4.5; // px
  constexpr double kOpacity = 0.85;
  constexpr Rgb kEdge{20, 20, 20}, kAround{255, 255, 255};
  const auto place = [&](const Eigen::Vector3d& p, double above) {
    return view.project(p + above * (sole.normal + view.towardsEye(p)));
  };
  // The halo lies below the edges, which the depth test would mix otherwise.
  std::vector<ScreenPoint> corners, halo;
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& corner : sole.corners) {
    const auto at = place(corner, kAbove), below = place(corner, 0.8 * kAbove);
    if (!at || !below)
      return; // behind the eye
    corners.push_back(*at);
    halo.push_back(*below);
    middle += corner / static_cast<double>(sole.corners.size());
  }
  const auto centre = place(middle, kAbove), toe = place(sole.toe, kAbove);
  if (!centre || !toe)
    return;
  const Rgb color =
      scaled(riskColor(sole.total), 0.75 + 0.35 * view.brightness(sole.normal));
  drawRing(canvas, halo, kHalo, kAround); // from patches of the same colour
  for (std::size_t i = 0; i < corners.size(); ++i)
    canvas.drawTriangle({*centre, corners[i], corners[(i + 1) % corners.size()]},
                        color,
                        kOpacity);
  drawRing(canvas, corners, kWidth, kEdge);
  canvas.drawLine(*centre, *toe, kWidth, kEdge);
}

int
riskLegendHeight()
{
  return 44;
}

void
drawRiskLegend(Canvas& canvas, const Frame& frame, const Rgb& text)
{
  canvas.clip(frame);
  std::vector<ScaleTick> ticks;
  for (const auto& [total, word] : {std::pair<double, const char*>{1e-3, "0.1 %"},
                                    {1e-2, "1 %"},
                                    {1e-1, "10 %"},
                                    {1.0, "100 %"}})
    ticks.push_back({riskFraction(total), word});
  drawScale(canvas,
            frame,
            "total risk (grey: too little seen)",
            ticks,
            riskScaleColor,
            text);
}

} // namespace holdfast::app
