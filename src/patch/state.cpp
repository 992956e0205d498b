#include <holdfast/patch/state.h>

#include "geometry/symmetric.h"
#include "patch/state_parameters.h"
#include <holdfast/geometry/rotation.h>

#include <Eigen/Geometry>

#include <cmath>
#include <stdexcept>

namespace holdfast {
namespace {

/// xx xy yy of a symmetric matrix in axes turned by the angle.
Eigen::Vector3d
turned(const Eigen::Vector3d& m, double angle)
{
  return symmetric::planeTurn(angle) * m;
}

/// Moments along the patch's own axes from its bounds: as patchOf() makes them.
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
  return patchOf(axesOf(state), squaredBoundPerMoment(state.type.surface, containment));
}

PatchState
toState(const Patch& patch, double containment)
{
  const double squared = squaredBoundPerMoment(patch.type.surface, containment);
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
