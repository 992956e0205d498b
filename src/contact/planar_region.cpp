#include <holdfast/contact/planar_region.h>

#include <holdfast/contact/foothold.h>
#include <holdfast/geometry/constants.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <stdexcept>

namespace holdfast {
namespace {

/// Points of an ellipse, counter-clockwise.
PlanarOutline
ellipse(const Eigen::Vector2d& half_axes, int corners)
{
  PlanarOutline outline;
  for (int i = 0; i < corners; ++i) {
    const double angle = 2.0 * kPi * i / corners;
    outline.emplace_back(half_axes.x() * std::cos(angle),
                         half_axes.y() * std::sin(angle));
  }
  return outline;
}

/// Whether all of an ellipse about the patch's centre was seen, told ring by ring.
bool
isSeenAllOver(const Patch& patch,
              const MapPatch& seen,
              const Eigen::Vector2d& half_axes)
{
  constexpr int kRings = 6;
  const Pose to_anchor = seen.anchor.inverse() * patch.pose();
  for (int ring = 0; ring <= kRings; ++ring)
    for (const Eigen::Vector2d& p :
         ellipse(half_axes * ring / kRings, ring == 0 ? 1 : 6 * ring)) {
      const Eigen::Vector3d q = to_anchor.toWorld({p.x(), p.y(), 0.0}) / seen.radius_m;
      if (!seen.support.contains(q.x(), q.y()))
        return false;
    }
  return true;
}

/// The largest of the same shape that was; nothing below a quarter of its size.
std::optional<Eigen::Vector2d>
seenHalfAxes(const Patch& patch, const MapPatch& seen)
{
  constexpr int kSizes = 16;
  const Eigen::Vector2d whole = patch.type.boundary == BoundaryType::Circle ?
                                    Eigen::Vector2d::Constant(patch.d[0]) :
                                    Eigen::Vector2d(patch.d.head<2>());
  for (int size = kSizes; size >= kSizes / 4; --size)
    if (const Eigen::Vector2d half_axes = whole * size / kSizes;
        isSeenAllOver(patch, seen, half_axes))
      return half_axes;
  return std::nullopt;
}

std::optional<PlanarRegion>
regionOf(const MapPatch& seen, const PlanarRegionOptions& options)
{
  const FitResult fit = toFitResult(seen);
  if (!isUsable(fit.status))
    return std::nullopt;
  const double curvature = fit.patch.principalCurvatures().cwiseAbs().maxCoeff();
  if (0.5 * curvature * seen.radius_m * seen.radius_m >= options.max_sagitta_m)
    return std::nullopt;
  const auto half_axes = seenHalfAxes(fit.patch, seen);
  if (!half_axes)
    return std::nullopt;
  PlanarRegion region;
  region.patch = seen.id;
  region.pose = fit.patch.pose();
  region.boundary.outer = ellipse(*half_axes, options.corners);
  region.high = *half_axes;
  region.low = -*half_axes;
  // Bounds come first among the parameters; a circle has one.
  const Eigen::Index second = fit.patch.type.boundary == BoundaryType::Circle ? 0 : 1;
  const Eigen::Vector2d sigma(std::sqrt(fit.covariance(0, 0)),
                              std::sqrt(fit.covariance(second, second)));
  const Eigen::Vector2d inner = *half_axes - options.inset_sigmas * sigma;
  if (inner.minCoeff() > 0.0) // false for NaN, too
    region.insets.push_back({ellipse(inner, options.corners), {}});
  return region;
}

} // namespace

std::string
validityError(const PlanarRegionOptions& options)
{
  if (!std::isfinite(options.max_sagitta_m) || options.max_sagitta_m <= 0.0)
    return "the largest sagitta of a planar region must be > 0";
  if (!std::isfinite(options.inset_sigmas) || options.inset_sigmas < 0.0)
    return "the inset of a planar region must not be negative";
  return options.corners >= 3 ? "" : "an outline wants at least three corners";
}

std::vector<PlanarRegion>
planarRegions(const PatchMap& map, const PlanarRegionOptions& options)
{
  if (const std::string error = validityError(options); !error.empty())
    throw std::invalid_argument("holdfast::planarRegions: " + error);
  std::vector<PlanarRegion> regions;
  for (const MapPatch& patch : map.patches())
    if (auto region = regionOf(patch, options))
      regions.push_back(std::move(*region));
  return regions;
}

} // namespace holdfast
