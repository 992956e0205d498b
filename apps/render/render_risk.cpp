#include "render_risk.h"

#include "risk_colors.h"

#include <cstddef>
#include <stdexcept>
#include <utility>
#include <vector>

namespace holdfast::app {
namespace {

void
drawRing(Canvas& canvas,
         const std::vector<ScreenPoint>& points,
         double width,
         const Rgb& color)
{
  for (std::size_t i = 0; i < points.size(); ++i)
    canvas.drawLine(points[i], points[(i + 1) % points.size()], width, color);
}

} // namespace

RiskPicture
readRisk(const std::string& text)
{
  if (!isRiskResult(text))
    throw std::runtime_error("is no result of 'holdfast risk', which --color risk "
                             "shows");
  RiskResult result = readRiskResult(text);
  RiskPicture picture;
  picture.source = result.source;
  picture.is_of_map = result.is_of_map;
  picture.reading = {std::move(result.source),
                     std::move(result.file),
                     result.sensor_pose};
  picture.soles = std::move(result.soles);
  for (TriedPatch& tried : result.patches)
    if (isUsable(tried.patch.fit.status)) {
      picture.patches.push_back(std::move(tried.patch));
      picture.colors.push_back(tried.total ? riskColor(*tried.total) : kNoSupport);
    }
  return picture;
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
  for (const Eigen::Vector3d& corner : sole.corners) {
    const auto at = place(corner, kAbove), below = place(corner, 0.8 * kAbove);
    if (!at || !below)
      return; // behind the eye
    corners.push_back(*at);
    halo.push_back(*below);
  }
  const auto centre = place(sole.middle, kAbove), toe = place(sole.toe, kAbove);
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
