#include <holdfast/patch/state.h>

#include "geometry/symmetric.h"
#include <holdfast/geometry/rotation.h>

#include <Eigen/Geometry>

#include <boost/math/special_functions/erf.hpp>

#include <cmath>
#include <stdexcept>

namespace holdfast {
namespace {

/// d^2 over the moment it belongs to: 2 erfinv(Gamma)^2 of stage II-4 for what is
/// bounded axis by axis, -2 ln(1 - Gamma) of II-9 for planes.
double
squaredBoundPerMoment(PatchType type, double containment)
{
  if (!(containment > 0.0 && containment < 1.0))
    throw std::invalid_argument("holdfast: containment must lie between 0 and 1");
  if (type.surface == SurfaceType::Plane)
    return -2.0 * std::log1p(-containment);
  const double quantile = boost::math::erf_inv(containment);
  return 2.0 * quantile * quantile;
}

/// xx xy yy of a symmetric matrix in axes turned by the angle.
Eigen::Vector3d
turned(const Eigen::Vector3d& m, double angle)
{
  return symmetric::planeTurn(angle) * m;
}

/// Angle to the axis of the larger eigenvalue.
double
angleOfLarger(const Eigen::Vector3d& m)
{
  return 0.5 * std::atan2(2.0 * m[1], m[0] - m[2]);
}

/// Angle of the patch's x axis: of planes that of the larger moment, of curved surfaces
/// that of the smaller |curvature|.
double
angleOfX(const PatchState& state)
{
  if (state.type.surface == SurfaceType::Plane)
    return angleOfLarger(state.moments);
  constexpr double kQuarterTurn = 1.5707963267948966;
  const double mean = 0.5 * (state.curvature[0] + state.curvature[2]);
  return angleOfLarger(state.curvature) + (mean > 0.0 ? kQuarterTurn : 0.0);
}

Eigen::Matrix3d
turnedAboutNormal(const Eigen::Matrix3d& R, double angle)
{
  return R * expMap({0.0, 0.0, angle});
}

/// Bounds from the moments along the patch's own axes.
void
bound(const Eigen::Vector3d& m, double squared, Patch& patch)
{
  switch (patch.type.boundary) {
  case BoundaryType::Circle:
    patch.d[0] = std::sqrt(squared * 0.5 * (m[0] + m[2]));
    break;
  case BoundaryType::Quad:
    patch.d.head<4>().setConstant(std::sqrt(squared * (m[0] + m[2])));
    patch.d[4] = std::atan2(std::sqrt(m[2]), std::sqrt(m[0]));
    break;
  case BoundaryType::Ellipse:
  case BoundaryType::Rectangle:
    patch.d[0] = std::sqrt(squared * m[0]);
    patch.d[1] = std::sqrt(squared * m[2]);
    break;
  }
}

/// Moments along the patch's own axes from its bounds: the inverse of bound().
Eigen::Vector3d
momentsOf(const Patch& patch, double squared)
{
  const auto moment = [&](double d) { return d * d / squared; };
  switch (patch.type.boundary) {
  case BoundaryType::Circle:
    return {moment(patch.d[0]), 0.0, moment(patch.d[0])};
  case BoundaryType::Quad: {
    const double sum = moment(patch.d[0]), c = std::cos(patch.d[4]);
    return {sum * c * c, 0.0, sum * (1.0 - c * c)};
  }
  case BoundaryType::Ellipse:
  case BoundaryType::Rectangle:
    break;
  }
  return {moment(patch.d[0]), 0.0, moment(patch.d[1])};
}

} // namespace

Eigen::Matrix3d
PatchState::frame() const
{
  return frameFromZ(normal);
}

StateLayout
stateLayoutOf(PatchType type)
{
  const int curvatures = curvatureParameterCount(type.surface);
  if (isRevolute(type))
    return {1, curvatures};
  return {3, curvatures > 0 ? 3 : 0};
}

std::vector<std::string>
stateNames(PatchType type)
{
  const StateLayout layout = stateLayoutOf(type);
  std::vector<std::string> names;
  const auto add = [&names](int count, const std::string& one) {
    if (count == 1)
      names.push_back(one);
    else if (count == 3)
      names.insert(names.end(), {one + "_xx", one + "_xy", one + "_yy"});
  };
  add(layout.m_count, "M");
  add(layout.k_count, "k");
  names.insert(names.end(), {"nu_x", "nu_y", "c_x", "c_y", "c_z"});
  return names;
}

namespace {

StateVector
packed(PatchType type,
       const Eigen::Vector3d& moments,
       const Eigen::Vector3d& curvature,
       const Eigen::Vector2d& nu,
       const Eigen::Vector3d& centre)
{
  const StateLayout layout = stateLayoutOf(type);
  StateVector x(layout.size());
  const auto put = [&x](int at, int count, const Eigen::Vector3d& m) {
    if (count == 1)
      x[at] = 0.5 * (m[0] + m[2]);
    else if (count == 3)
      x.segment<3>(at) = m;
  };
  put(0, layout.m_count, moments);
  put(layout.k(), layout.k_count, curvature);
  x.segment<2>(layout.nu()) = nu;
  x.tail<3>() = centre;
  return x;
}

} // namespace

StateVector
pack(const PatchState& state)
{
  return packed(state.type,
                state.moments,
                state.curvature,
                Eigen::Vector2d::Zero(),
                state.centre);
}

PatchState
unpackState(PatchType type,
            const StateVector& coordinates,
            const Eigen::Vector3d& normal)
{
  const StateLayout layout = stateLayoutOf(type);
  if (coordinates.size() != layout.size())
    throw std::invalid_argument(
        "holdfast::unpackState: " + std::to_string(layout.size()) +
        " coordinates expected, " + std::to_string(coordinates.size()) + " given");
  const auto group = [&coordinates](int at, int count) {
    Eigen::Vector3d m = Eigen::Vector3d::Zero();
    if (count == 1)
      m[0] = m[2] = coordinates[at];
    else if (count == 3)
      m = coordinates.segment<3>(at);
    return m;
  };
  PatchState state;
  state.type = type;
  state.moments = group(0, layout.m_count);
  state.curvature = group(layout.k(), layout.k_count);
  state.normal = normal.normalized();
  state.centre = coordinates.tail<3>();
  return state;
}

StateVector
difference(const PatchState& state, const PatchState& reference)
{
  if (state.type != reference.type)
    throw std::invalid_argument("holdfast::difference: states of different types");
  const Eigen::Matrix3d R = reference.frame();
  const Eigen::Vector2d nu = rxyFromNormal(R.transpose() * state.normal);
  const Eigen::Matrix3d W =
      (R * expMap({nu.x(), nu.y(), 0.0})).transpose() * state.frame();
  const double angle = std::atan2(W(0, 1), W(0, 0)); // from the state's axes to these
  return packed(state.type,
                turned(state.moments, angle),
                turned(state.curvature, angle),
                nu,
                state.centre) -
         pack(reference);
}

Patch
toPatch(const PatchState& state, double containment)
{
  const double squared = squaredBoundPerMoment(state.type, containment);
  Patch patch;
  patch.type = state.type;
  patch.c = state.centre;
  if (isRevolute(state.type)) {
    bound(state.moments, squared, patch);
    if (curvatureParameterCount(state.type.surface) == 1)
      patch.kappa[0] = 0.5 * (state.curvature[0] + state.curvature[2]);
    patch.r << regularRxyFromNormal(state.normal), 0.0;
    return patch;
  }
  const double angle = angleOfX(state);
  bound(turned(state.moments, angle), squared, patch);
  const Eigen::Vector3d k = turned(state.curvature, angle);
  const int curvatures = curvatureParameterCount(state.type.surface);
  if (curvatures == 1)
    patch.kappa[0] = k[2];
  else if (curvatures == 2)
    patch.kappa << k[0], k[2];
  patch.r = logMap(turnedAboutNormal(state.frame(), angle));
  return canonical(patch);
}

PatchState
toState(const Patch& patch, double containment)
{
  const double squared = squaredBoundPerMoment(patch.type, containment);
  PatchState state;
  state.type = patch.type;
  state.normal = patch.normal();
  state.centre = patch.c;
  const Eigen::Vector2d k = patch.principalCurvatures();
  const Eigen::Matrix3d W = state.frame().transpose() * patch.pose().R;
  const double angle = std::atan2(W(0, 1), W(0, 0)); // from the patch's axes
  state.moments = turned(momentsOf(patch, squared), angle);
  state.curvature = turned({k.x(), 0.0, k.y()}, angle);
  return state;
}

} // namespace holdfast
