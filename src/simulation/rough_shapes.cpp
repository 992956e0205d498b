#include <holdfast/simulation/shape.h>

#include "portable_random.h"
#include "ray.h"
#include "sensor/require.h"

#include <limits>
#include <random>

namespace holdfast {

namespace {

constexpr double kTwoPi = 6.283185307179586;

Eigen::Vector3d
randomDirection(bool planar, std::mt19937_64& generator)
{
  const double angle = kTwoPi * uniform(generator);
  const double z = planar ? 0.0 : 2.0 * uniform(generator) - 1.0;
  const double across = std::sqrt(1.0 - z * z);
  return {across * std::cos(angle), across * std::sin(angle), z};
}

/// Where a ray, t >= 0, comes into a ball around the origin; infinite: nowhere.
double
entryOfBall(const Eigen::Vector3d& origin,
            const Eigen::Vector3d& direction,
            double radius)
{
  const double away = origin.squaredNorm() - radius * radius;
  if (away <= 0.0)
    return 0.0;
  const double along = origin.dot(direction);
  const double d2 = direction.squaredNorm();
  const double discriminant = along * along - away * d2;
  if (along >= 0.0 || discriminant < 0.0)
    return std::numeric_limits<double>::infinity();
  return (-along - std::sqrt(discriminant)) / d2;
}

} // namespace

WaveSum::WaveSum(double amplitude, double wavelength, bool planar, std::uint64_t seed)
: amplitude_(amplitude)
{
  requireNotNegative("amplitude", amplitude);
  requirePositive("wavelength", wavelength);
  constexpr int kWaves = 10;
  std::mt19937_64 generator(seed);
  double total = 0.0;
  for (int i = 0; i < kWaves; ++i) {
    // Shorter waves are lower in proportion: the same steepness at every scale.
    const double relative_number = 1.0 + 2.0 * i / (kWaves - 1);
    const Eigen::Vector3d direction = randomDirection(planar, generator);
    waves_.push_back({1.0 / relative_number,
                      kTwoPi / wavelength * relative_number * direction,
                      kTwoPi * uniform(generator)});
    total += waves_.back().amplitude;
  }
  for (Wave& wave : waves_) {
    wave.amplitude *= amplitude / total;
    max_slope_ += wave.amplitude * wave.number.norm();
  }
}

double
WaveSum::operator()(const Eigen::Vector3d& p) const
{
  double sum = 0.0;
  for (const Wave& wave : waves_)
    sum += wave.amplitude * std::sin(wave.number.dot(p) + wave.phase);
  return sum;
}

Terrain::Terrain(const Eigen::Vector3d& center,
                 double size,
                 double bump_height,
                 double bump_length,
                 std::uint64_t seed)
: center_(center)
, size_(size)
, bump_length_(bump_length)
, seed_(seed)
, bumps_(bump_height, bump_length, true, seed)
{
  requirePositive("size", size);
}

double
Terrain::heightAt(double x, double y) const
{
  return center_.z() + bumps_({x - center_.x(), y - center_.y(), 0.0});
}

std::optional<double>
Terrain::intersect(const Eigen::Vector3d& origin,
                   const Eigen::Vector3d& direction) const
{
  auto inside = clipToBox(origin - center_, direction, halfBox());
  if (!inside || inside->end < 0.0)
    return std::nullopt;
  inside->begin = std::max(inside->begin, 0.0);
  const auto above = [&](double t) {
    const Eigen::Vector3d q = origin + t * direction;
    return q.z() - heightAt(q.x(), q.y());
  };
  const double max_slope =
      std::abs(direction.z()) + bumps_.maxSlope() * direction.head<2>().norm();
  return firstRoot(above, *inside, max_slope);
}

Eigen::Vector3d
Terrain::halfBox() const
{
  // The margin keeps flat ground from being a box without volume.
  return {0.5 * size_, 0.5 * size_, bumps_.amplitude() + 1e-6 * size_};
}

double
Terrain::nearestPossible(const Eigen::Vector3d& origin,
                         const Eigen::Vector3d& direction) const
{
  const auto inside = clipToBox(origin - center_, direction, halfBox());
  return inside ? std::max(inside->begin, 0.0) :
                  std::numeric_limits<double>::infinity();
}

std::string
Terrain::name() const
{
  return "terrain";
}

std::vector<ShapeParameter>
Terrain::parameters() const
{
  return {{"center", center_},
          {"size", size_},
          {"bump_height", bumps_.amplitude()},
          {"bump_length", bump_length_},
          {"seed", static_cast<double>(seed_)}};
}

// On the unit ball the longest wave fits three times around the equator, roughly.
Boulder::Boulder(const Pose& pose,
                 const Eigen::Vector3d& radii,
                 double roughness,
                 std::uint64_t seed)
: pose_(pose), radii_(radii), seed_(seed), bumps_(roughness, 2.0, false, seed)
{
  for (int axis = 0; axis < 3; ++axis)
    requirePositive("radii", radii[axis]);
  if (roughness >= 0.5)
    throw ParameterError("roughness", "must be below 0.5");
  // The margin is far beyond rounding.
  outer_radius_ = 1.001 * (1.0 + roughness) * radii.maxCoeff();
}

Eigen::Vector3d
Boulder::toUnitBall(const Eigen::Vector3d& world) const
{
  return pose_.toLocal(world).cwiseQuotient(radii_);
}

double
Boulder::unitBallValue(const Eigen::Vector3d& p) const
{
  return p.norm() - 1.0 - bumps_(p.normalized());
}

double
Boulder::implicitValue(const Eigen::Vector3d& world) const
{
  return unitBallValue(toUnitBall(world));
}

std::optional<double>
Boulder::intersect(const Eigen::Vector3d& origin,
                   const Eigen::Vector3d& direction) const
{
  // Cheap, and nearly every ray to a field of boulders ends here.
  if (std::isinf(nearestPossible(origin, direction)))
    return std::nullopt;
  const Eigen::Vector3d o = toUnitBall(origin);
  const Eigen::Vector3d d = (pose_.R.transpose() * direction).cwiseQuotient(radii_);
  // A cube around the bumps; the value is positive in its corners.
  const double reach = 1.0 + bumps_.amplitude();
  auto inside = clipToBox(o, d, Eigen::Vector3d::Constant(reach));
  if (!inside || inside->end < 0.0)
    return std::nullopt;
  inside->begin = std::max(inside->begin, 0.0);
  // Turning the direction p/|p| is fastest nearest to the centre, and no ray comes
  // nearer than 1 - amplitude before it has met the surface.
  const double max_slope =
      d.norm() * (1.0 + bumps_.maxSlope() / (1.0 - bumps_.amplitude()));
  return firstRoot([&](double t) { return unitBallValue(o + t * d); },
                   *inside,
                   max_slope);
}

double
Boulder::nearestPossible(const Eigen::Vector3d& origin,
                         const Eigen::Vector3d& direction) const
{
  return entryOfBall(origin - pose_.c, direction, outer_radius_);
}

std::string
Boulder::name() const
{
  return "boulder";
}

std::vector<ShapeParameter>
Boulder::parameters() const
{
  return {{"center", pose_.c},
          {"x_axis", pose_.R.col(0)},
          {"y_axis", pose_.R.col(1)},
          {"radii", radii_},
          {"roughness", bumps_.amplitude()},
          {"seed", static_cast<double>(seed_)}};
}

} // namespace holdfast
