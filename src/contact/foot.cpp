#include <holdfast/contact/foot.h>

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace holdfast {
namespace {

using Eigen::Vector2d;

double
cross(const Vector2d& a, const Vector2d& b)
{
  return a.x() * b.y() - a.y() * b.x();
}

/// Twice the area, positive when the corners go round to the left.
double
signedDoubleArea(const std::vector<Vector2d>& corners)
{
  double sum = 0.0;
  for (std::size_t i = 0; i < corners.size(); ++i)
    sum += cross(corners[i], corners[(i + 1) % corners.size()]);
  return sum;
}

/// Whether two edges have a point in common.
bool
meet(const Vector2d& a, const Vector2d& b, const Vector2d& c, const Vector2d& d)
{
  const double abc = cross(b - a, c - a), abd = cross(b - a, d - a);
  const double cda = cross(d - c, a - c), cdb = cross(d - c, b - c);
  if (abc == 0.0 && abd == 0.0) // on one line
    return (c - a).dot(c - b) <= 0.0 || (d - a).dot(d - b) <= 0.0 ||
           (a - c).dot(a - d) <= 0.0;
  return abc * abd <= 0.0 && cda * cdb <= 0.0;
}

/// Whether edges that do not follow each other meet, or one turns straight back.
bool
isSelfCrossing(const std::vector<Vector2d>& corners)
{
  const std::size_t n = corners.size();
  const auto at = [&](std::size_t i) { return corners[i % n]; };
  for (std::size_t i = 0; i < n; ++i) {
    const Vector2d in = at(i + 1) - at(i), out = at(i + 2) - at(i + 1);
    if (in.isZero(0.0) || (cross(in, out) == 0.0 && in.dot(out) < 0.0))
      return true;
    for (std::size_t j = i + 2; j < n; ++j)
      if ((j + 1) % n != i && meet(at(i), at(i + 1), at(j), at(j + 1)))
        return true;
  }
  return false;
}

bool
isPositive(double x)
{
  return std::isfinite(x) && x > 0.0;
}

std::string
soleError(const Foot& foot)
{
  if (foot.sole.size() < 3)
    return "a sole wants at least three corners";
  for (const Vector2d& corner : foot.sole)
    if (!corner.allFinite())
      return "the corners of a sole must be finite numbers";
  if (isSelfCrossing(foot.sole))
    return "the edges of a sole must not cross or touch each other";
  if (!(soleArea(foot) > 0.0))
    return "a sole must have an area";
  constexpr double kLeast = 1e-3; // m; what is less was meant in another unit
  Vector2d low = foot.sole.front(), high = low;
  for (const Vector2d& corner : foot.sole) {
    low = low.cwiseMin(corner);
    high = high.cwiseMax(corner);
  }
  if (!((high - low).minCoeff() >= kLeast))
    return "a sole must be at least 1 mm long and wide";
  return foot.curvature.allFinite() ? "" : "the curvature of a sole must be finite";
}

} // namespace

Foot
rectangularFoot(double length_m, double width_m)
{
  const double x = 0.5 * length_m, y = 0.5 * width_m;
  Foot foot;
  foot.sole = {{x, y}, {-x, y}, {-x, -y}, {x, -y}};
  return foot;
}

std::string
validityError(const Foot& foot)
{
  if (std::string error = soleError(foot); !error.empty())
    return error;
  const ContactTolerances& t = foot.tolerances;
  if (!isPositive(foot.friction.mean))
    return "friction must have a mean > 0";
  if (!std::isfinite(foot.friction.sigma) || foot.friction.sigma < 0.0)
    return "the sigma of friction must not be negative";
  if (foot.friction.sigma > foot.friction.mean)
    return "the sigma of friction must not be above its mean";
  if (!isPositive(t.height_m) || !isPositive(t.gap_m) || !isPositive(t.contact_m))
    return "tolerances of height, gap and contact must be > 0";
  // From 1.5 rad on its tangent is beyond any slope that a patch can have.
  if (!isPositive(t.tilt_rad) || t.tilt_rad >= 1.5)
    return "the tolerance of tilt must be between 0 and 1.5 rad";
  return t.min_support > 0.0 && t.min_support <= 1.0 ?
             "" :
             "the support that is asked for must be a share > 0 and <= 1";
}

double
soleArea(const Foot& foot)
{
  return 0.5 * std::abs(signedDoubleArea(foot.sole));
}

double
soleReach(const Foot& foot)
{
  double reach = 0.0;
  for (const Vector2d& corner : foot.sole)
    reach = std::max(reach, corner.norm());
  return reach;
}

double
patchRadiusFor(const Foot& foot)
{
  constexpr double kBeyond = 1.1, kLeast = 0.04; // share, m
  return std::max(kBeyond * soleReach(foot), kLeast);
}

} // namespace holdfast
