#include "core/settings.h"

#include <cmath>
#include <tuple>

namespace holdfast::robot {
namespace {

auto
asTuple(const Tuning& t)
{
  return std::tie(t.radius_m,
                  t.max_patches,
                  t.budget_ms,
                  t.max_chi2_per_dof,
                  t.min_coverage,
                  t.max_view_angle_deg,
                  t.max_curvature_per_m);
}

bool
isNonNegative(double x)
{
  return std::isfinite(x) && x >= 0.0;
}

} // namespace

bool
operator==(const Tuning& a, const Tuning& b)
{
  return asTuple(a) == asTuple(b);
}

std::string
validityError(const Tuning& tuning)
{
  if (!isNonNegative(tuning.radius_m))
    return "radius must not be negative";
  if (tuning.max_patches < 0)
    return "max_patches must not be negative";
  if (!isNonNegative(tuning.budget_ms))
    return "budget_ms must not be negative";
  if (!(tuning.max_chi2_per_dof > 0.0))
    return "max_chi2_per_dof must be positive";
  if (!(tuning.min_coverage >= 0.0 && tuning.min_coverage <= 1.0))
    return "min_coverage must lie between 0 and 1";
  if (!(tuning.max_view_angle_deg > 0.0 && tuning.max_view_angle_deg <= 90.0))
    return "max_view_angle must lie between 0 and 90 degrees";
  if (!isNonNegative(tuning.max_curvature_per_m))
    return "max_curvature must not be negative";
  return {};
}

FootholdOptions
footholdOptions(const Settings& settings)
{
  FootholdOptions options;
  options.load_direction = settings.load_direction.value_or(options.load_direction);
  options.yaws = settings.yaws;
  options.spacing_m = settings.foothold_spacing_m;
  options.max_footholds = settings.max_footholds;
  options.threads = settings.threads;
  return options;
}

RiskGridOptions
gridOptions(const Settings& settings)
{
  RiskGridOptions options;
  options.load_direction = settings.load_direction.value_or(options.load_direction);
  options.yaws = settings.yaws;
  options.resolution_m = settings.grid_resolution_m;
  options.threads = settings.threads;
  return options;
}

std::string
validityError(const Settings& settings)
{
  if (!(settings.motion_sigma_rad > 0.0 && settings.motion_sigma_m > 0.0))
    return "the sigmas of a motion must be positive";
  if (settings.map && surfaceOf(settings.surface))
    return "a map is of paraboloids: its surface is auto or paraboloid";
  if (settings.threads < 0)
    return "threads must not be negative";
  const std::string error = validityError(footholdOptions(settings));
  return error.empty() ? validityError(gridOptions(settings)) : error;
}

} // namespace holdfast::robot
