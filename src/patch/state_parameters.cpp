#include "patch/state_parameters.h"

#include "geometry/safe_gap.h"
#include "geometry/symmetric.h"
#include "patch/canonical_axis.h"
#include <holdfast/geometry/constants.h>
#include <holdfast/geometry/rotation.h>

#include <Eigen/Geometry>

#include <boost/math/special_functions/erf.hpp>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace holdfast {
namespace {

// Derivative with respect to the state's coordinates.
using Row = Eigen::Matrix<double, 1, Eigen::Dynamic, Eigen::RowMajor, 1, kMaxState>;
using Rows3 = Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::RowMajor, 3, kMaxState>;

double
angleOfLarger(const Eigen::Vector3d& m)
{
  return 0.5 * std::atan2(2.0 * m[1], m[0] - m[2]);
}

StateAxes
turnedBy(const PatchState& state, double angle)
{
  const Eigen::Matrix3d frame = state.frame(), T = symmetric::planeTurn(angle);
  StateAxes axes;
  axes.type = state.type;
  axes.R = frame;
  axes.R.col(0) = std::cos(angle) * frame.col(0) + std::sin(angle) * frame.col(1);
  axes.R.col(1) = std::cos(angle) * frame.col(1) - std::sin(angle) * frame.col(0);
  axes.moments = T * state.moments;
  axes.curvature = T * state.curvature;
  axes.centre = state.centre;
  return axes;
}

// From the state's own frame about the normal.
double
angleOf(const StateAxes& axes)
{
  const Eigen::Matrix3d frame = frameFromZ(axes.R.col(2));
  return std::atan2(axes.R.col(0).dot(frame.col(1)), axes.R.col(0).dot(frame.col(0)));
}

// II-6 to II-9, the bounds from the moments along the patch's axes.
void
bound(const Eigen::Vector3d& m, double squared, Patch& patch)
{
  const auto root = [](double x) { return std::sqrt(std::max(x, 0.0)); };
  switch (patch.type.boundary) {
  case BoundaryType::Circle:
    patch.d[0] = root(squared * 0.5 * (m[0] + m[2]));
    break;
  case BoundaryType::Quad:
    // Paper eqs. (15) and (17): |l|^2 = l+^2 + l-^2, gamma = atan2(l-, l+).
    patch.d.head<4>().setConstant(root(squared * (m[0] + m[2])));
    patch.d[4] = std::atan2(root(m[2]), root(m[0]));
    break;
  case BoundaryType::Ellipse:
  case BoundaryType::Rectangle:
    patch.d[0] = root(squared * m[0]);
    patch.d[1] = root(squared * m[2]);
    break;
  }
}

// The Jacobian of patchOf(), filled group by group.
class JacobianWriter {
public:
  JacobianWriter(const StateAxes& axes, double squared_bound)
  : type_(axes.type)
  , axes_(axes)
  , patch_(patchOf(axes, squared_bound))
  , squared_(squared_bound)
  , from_(stateLayoutOf(type_))
  , to_(layoutOf(type_))
  {
    J_.setZero(to_.size(), from_.size());
  }

  ParametersByAxes jacobian()
  {
    J_.bottomRightCorner<3, 3>().setIdentity();
    if (isRevolute(type_))
      writeRound();
    else
      writeTwoAxes();
    return J_;
  }

private:
  // d sqrt(squared m) / dm, zero at zero.
  double byMoment(double d) const
  {
    return d > 0.0 ? squared_ / (2.0 * d) : 0.0;
  }

  void writeRound()
  {
    J_(0, 0) = byMoment(patch_.d[0]);
    if (from_.k_count > 0)
      J_(to_.k(), from_.k()) = 1.0;
    Eigen::Matrix2d by_turn = Eigen::Matrix2d::Identity();
    rxyJacobian(patch_.r.head<2>(), by_turn);
    const Eigen::Matrix3d to_patch = expMap(patch_.r).transpose() * axes_.R;
    J_.block<2, 2>(to_.r(), from_.nu()) = by_turn * to_patch.topLeftCorner<2, 2>();
  }

  void writeTwoAxes()
  {
    const Eigen::Vector3d& m = axes_.moments;
    const Eigen::Vector3d& k = axes_.curvature;
    const bool flat = from_.k_count == 0;
    // The axes turn with what they are the principal axes of.
    Row twist = Row::Zero(from_.size());
    if (flat)
      twist[1] = 1.0 / safeGap(m[0] - m[2], m[0]);
    else
      twist[from_.k() + 1] = 1.0 / safeGap(k[0] - k[2], k.cwiseAbs().maxCoeff());
    Row xx = 2.0 * m[1] * twist, yy = -2.0 * m[1] * twist;
    xx[0] += 1.0;
    yy[2] += 1.0;
    writeBounds(xx, yy);
    if (!flat)
      writeCurvatures();
    Rows3 delta = Rows3::Zero(3, from_.size());
    delta.block<2, 2>(0, from_.nu()).setIdentity();
    delta.row(2) = twist;
    J_.middleRows<3>(to_.r()) = rightJacobianInverse(patch_.r) * delta;
  }

  void writeBounds(const Row& xx, const Row& yy)
  {
    if (type_.boundary != BoundaryType::Quad) {
      J_.row(0) = byMoment(patch_.d[0]) * xx;
      J_.row(1) = byMoment(patch_.d[1]) * yy;
      return;
    }
    for (int i = 0; i < 4; ++i)
      J_.row(i) = byMoment(patch_.d[i]) * (xx + yy);
    const double alpha = std::max(axes_.moments[0], 0.0);
    const double phi = std::max(axes_.moments[2], 0.0);
    const double sum = std::sqrt(alpha * phi) * (alpha + phi);
    if (sum > 0.0)
      J_.row(4) = (alpha * yy - phi * xx) / (2.0 * sum);
  }

  // In the principal axes xy is zero: their turn is of second order.
  void writeCurvatures()
  {
    const int curvatures = curvatureParameterCount(type_.surface);
    if (curvatures == 2)
      J_(to_.k(), from_.k()) = 1.0;
    J_(to_.k() + curvatures - 1, from_.k() + 2) = 1.0;
  }

  PatchType type_;
  const StateAxes& axes_;
  Patch patch_;
  double squared_;
  StateLayout from_;
  ParameterLayout to_;
  ParametersByAxes J_;
};

} // namespace

double
squaredBoundPerMoment(SurfaceType surface, double containment)
{
  if (!(containment > 0.0 && containment < 1.0))
    throw std::invalid_argument("holdfast: containment must lie between 0 and 1");
  if (surface == SurfaceType::Plane)
    return -2.0 * std::log1p(-containment);
  const double quantile = boost::math::erf_inv(containment);
  return 2.0 * quantile * quantile;
}

StateAxes
axesOf(const PatchState& state)
{
  if (isRevolute(state.type))
    return turnedBy(state, 0.0);
  const bool flat = state.type.surface == SurfaceType::Plane;
  double angle = angleOfLarger(flat ? state.moments : state.curvature);
  // The algebraically larger curvature is the stronger one where the mean is positive.
  if (!flat && state.curvature[0] + state.curvature[2] > 0.0)
    angle += 0.5 * kPi;
  StateAxes axes = turnedBy(state, angle);
  if (std::abs(axes.curvature[0]) > std::abs(axes.curvature[2])) // opposite but equal
    axes = turnedBy(state, angle += 0.5 * kPi);
  return pointsBackwards(axes.R.col(0)) ? turnedBy(state, angle + kPi) : axes;
}

PatchState
stateIn(const StateAxes& axes)
{
  PatchState state;
  state.type = axes.type;
  state.normal = axes.R.col(2);
  state.centre = axes.centre;
  const Eigen::Matrix3d T = symmetric::planeTurn(-angleOf(axes));
  state.moments = T * axes.moments;
  state.curvature = T * axes.curvature;
  return state;
}

StateMatrix
stateByAxes(const StateAxes& axes)
{
  const double angle = angleOf(axes);
  const StateLayout layout = stateLayoutOf(axes.type);
  StateMatrix turn = StateMatrix::Identity(layout.size(), layout.size());
  const Eigen::Matrix3d T = symmetric::planeTurn(-angle);
  if (layout.m_count == 3)
    turn.topLeftCorner<3, 3>() = T;
  if (layout.k_count == 3)
    turn.block<3, 3>(layout.k(), layout.k()) = T;
  const double c = std::cos(angle), s = std::sin(angle);
  turn.block<2, 2>(layout.nu(), layout.nu()) << c, -s, s, c;
  return turn;
}

Patch
patchOf(const StateAxes& axes, double squared_bound)
{
  Patch patch;
  patch.type = axes.type;
  patch.c = axes.centre;
  bound(axes.moments, squared_bound, patch);
  const Eigen::Vector3d& k = axes.curvature;
  const int curvatures = curvatureParameterCount(axes.type.surface);
  if (curvatures == 2)
    patch.kappa << k[0], k[2];
  else if (curvatures == 1)
    patch.kappa[0] = isRevolute(axes.type) ? 0.5 * (k[0] + k[2]) : k[2];
  if (isRevolute(axes.type))
    patch.r << regularRxyFromNormal(axes.R.col(2)), 0.0;
  else
    patch.r = logMap(axes.R);
  return patch;
}

ParametersByAxes
parametersByAxes(const StateAxes& axes, double squared_bound)
{
  return JacobianWriter(axes, squared_bound).jacobian();
}

} // namespace holdfast
