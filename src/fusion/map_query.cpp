#include <holdfast/fusion/patch_map.h>

#include "fit/discrimination.h"
#include "geometry/symmetric.h"
#include "patch/state_parameters.h"
#include "uncertainty/congruence.h"
#include "uncertainty/covariance.h"
#include <holdfast/geometry/gaussian.h>
#include <holdfast/geometry/rotation.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace holdfast {
namespace {

/// [kxx kxy kyy | nu_x nu_y | c_x c_y c_z] of a surface.
constexpr int kSurface = 8;

/// The surface of a jet as a state has it, and how it follows from the jet.
struct LocalSurface {
  Eigen::Vector3d curvature, normal, centre; ///< frame of the map
  Eigen::Matrix<double, kSurface, 6> by_jet;
  Eigen::Matrix2d tangent; ///< from the anchor's plane to the axes of the state
};

/// With g the gradient, H the Hessian, s = sqrt(1 + g^2) and e the tangent axes:
/// n = (-g, 1)/s and k_ij = e_i^T H e_j / s, of which only x and y of e count.
LocalSurface
surfaceOf(const JetVector& jet, const Pose& anchor)
{
  const Eigen::Vector2d g = jet.segment<2>(1);
  const double s = std::sqrt(1.0 + g.squaredNorm());
  Eigen::Matrix2d H;
  H << jet[3], jet[4], jet[4], jet[5];
  LocalSurface surface;
  surface.normal = anchor.R * (Eigen::Vector3d(-g.x(), -g.y(), 1.0) / s);
  surface.centre = anchor.toWorld({0.0, 0.0, jet[0]});
  const Eigen::Matrix3d E = anchor.R.transpose() * frameFromZ(surface.normal);
  const Eigen::Matrix2d e = E.topLeftCorner<2, 2>(); // columns
  const Eigen::Matrix2d K = e.transpose() * H * e / s;
  surface.curvature = {K(0, 0), K(0, 1), K(1, 1)};
  // d x = e^T (I + g g^T) dp for a step dp of the plane, whose z is g^T dp.
  surface.tangent = e.transpose() + E.row(2).head<2>().transpose() * g.transpose();

  auto& J = surface.by_jet;
  J.setZero();
  J.col(0).tail<3>() = anchor.R.col(2);
  const double inverse_s = 1.0 / s;
  const int row[3] = {0, 0, 1}, column[3] = {0, 1, 1};
  // The normal turns by dn = -(dg, 0)/s - n ds/s = nu_y e_1 - nu_x e_2.
  for (int a = 0; a < 2; ++a) {
    Eigen::Vector2d dg = Eigen::Vector2d::Zero();
    dg[a] = 1.0;
    const double nu_x = e.col(1).dot(dg) / s, nu_y = -e.col(0).dot(dg) / s;
    const double ds = g[a] / s;
    const Eigen::Vector2d n = E.col(2).head<2>();
    Eigen::Matrix2d de; // axes that do not twist
    de << -nu_y * n, nu_x * n;
    const Eigen::Matrix2d dK =
        (de.transpose() * H * e + e.transpose() * H * de) / s - K * ds / s;
    J.col(1 + a) << dK(0, 0), dK(0, 1), dK(1, 1), nu_x, nu_y, 0.0, 0.0, 0.0;
  }
  for (int b = 0; b < 3; ++b) {
    Eigen::Matrix2d dH = Eigen::Matrix2d::Zero();
    dH(row[b], column[b]) = dH(column[b], row[b]) = 1.0;
    const Eigen::Matrix2d dK = inverse_s * (e.transpose() * dH * e);
    J.col(3 + b).head<3>() << dK(0, 0), dK(0, 1), dK(1, 1);
  }
  return surface;
}

/// What is known of a jet when its curvatures are those of a simpler type: A k = 0.
template <int n>
void
constrain(const Eigen::Matrix<double, n, 6>& A, JetVector& jet, JetMatrix& P)
{
  const Eigen::Matrix<double, n, n> S = A * P * A.transpose();
  const Eigen::Matrix<double, 6, n> gain =
      S.llt().solve(Eigen::Matrix<double, n, 6>(A * P)).transpose();
  jet -= gain * (A * jet);
  P = symmetrized(JetMatrix(P - gain * A * P));
}

void
constrainTo(SurfaceType type, JetVector& jet, JetMatrix& P)
{
  if (type == SurfaceType::Plane) {
    Eigen::Matrix<double, 3, 6> A = Eigen::Matrix<double, 3, 6>::Zero();
    A.rightCols<3>().setIdentity();
    constrain<3>(A, jet, P);
    jet.tail<3>().setZero();
  }
  else if (type == SurfaceType::CircularParaboloid) {
    Eigen::Matrix<double, 2, 6> A = Eigen::Matrix<double, 2, 6>::Zero();
    A(0, 4) = A(1, 3) = 1.0;
    A(1, 5) = -1.0;
    constrain<2>(A, jet, P);
  }
}

/// Second moments of the support about the centre, in the axes of the state.
Eigen::Vector3d
momentsOf(const MapPatch& patch, const Eigen::Matrix2d& tangent)
{
  const auto& sums = patch.moments;
  Eigen::Matrix2d M;
  M << sums[3], sums[4], sums[4], sums[5];
  const Eigen::Matrix2d turned = tangent * (M / sums[0]) * tangent.transpose();
  return {turned(0, 0), turned(0, 1), turned(1, 1)};
}

Eigen::Matrix3d
momentsCovariance(const MapPatch& patch, const Eigen::Matrix2d& W)
{
  Packed<3> packed;
  std::copy(patch.moments_covariance.begin(),
            patch.moments_covariance.end(),
            packed.v.begin());
  const Eigen::Matrix3d T = symmetric::planeTurn(W);
  return T * packed.matrix() * T.transpose();
}

/// What they are at a level takes longer than all else here.
const DiscriminationThresholds&
thresholdsAt(double level)
{
  struct Known {
    double level;
    DiscriminationThresholds thresholds;
  };
  thread_local Known last{level, DiscriminationThresholds::atLevel(level)};
  if (last.level != level)
    last = {level, DiscriminationThresholds::atLevel(level)};
  return last.thresholds;
}

PatchType
typeOf(const JetVector& jet, const JetMatrix& P, const FitOptions& options)
{
  const SurfaceType surface =
      options.surface == SurfaceRequest::Auto ?
          discriminate(jet.tail<3>(),
                       P.bottomRightCorner<3, 3>(),
                       thresholdsAt(options.discrimination_level),
                       options) :
      jet[3] * jet[5] < jet[4] * jet[4] ? SurfaceType::HyperbolicParaboloid :
                                          SurfaceType::EllipticParaboloid;
  const bool plane = surface == SurfaceType::Plane;
  return {surface,
          plane && options.plane_boundary ? *options.plane_boundary :
                                            defaultBoundary(surface)};
}

template <typename Result, typename Jacobian, typename Covariance>
Result
propagated(const Jacobian& J, const Covariance& S)
{
  return SmallRows(J).template congruence<Result>(SmallRows(S));
}

/// [M | k | nu | c] of the type from moments and surface.
StateMatrix
stateCovariance(PatchType type,
                const Eigen::Matrix3d& moments,
                const Eigen::Matrix<double, kSurface, kSurface>& surface)
{
  const StateLayout layout = stateLayoutOf(type);
  StateMatrix S = StateMatrix::Zero(layout.size(), layout.size());
  // Of a round type both the moment and the curvature are means of two.
  Eigen::Matrix<double, 1, 3> mean;
  mean << 0.5, 0.0, 0.5;
  if (layout.m_count == 1)
    S(0, 0) = (mean * moments * mean.transpose())(0, 0);
  else
    S.topLeftCorner<3, 3>() = moments;
  Eigen::Matrix<double, Eigen::Dynamic, kSurface, 0, kSurface, kSurface> J;
  const int k = layout.k_count;
  J.setZero(k + 5, kSurface);
  if (k == 1)
    J.topLeftCorner<1, 3>() = mean;
  else if (k == 3)
    J.topLeftCorner<3, 3>().setIdentity();
  J.bottomRightCorner(5, 5).setIdentity();
  S.bottomRightCorner(k + 5, k + 5) = propagated<StateMatrix>(J, surface);
  return S;
}

/// Status and flags, as those of a fit.
void
judge(FitResult& result)
{
  PatchCovariance uncertainty;
  uncertainty.state = result.state_covariance;
  uncertainty.parameters = result.covariance;
  result.status = validityError(result.patch).empty() ?
                      statusOf(result.patch, uncertainty) :
                      FitStatus::Degenerate;
  const Linearity linearity = linearityOf(result.patch, uncertainty);
  result.flags = linearity.flags;
  result.nonlinearity = linearity.nonlinearity;
}

} // namespace

FitResult
toFitResult(const MapPatch& patch, const FitOptions& options)
{
  if (options.surface != SurfaceRequest::Auto &&
      options.surface != SurfaceRequest::Paraboloid)
    throw std::invalid_argument(
        "holdfast::toFitResult: the surface must be auto or paraboloid");
  if (const std::string error = validityError(options); !error.empty())
    throw std::invalid_argument("holdfast::toFitResult: " + error);
  JetVector jet = patch.jet.value();
  JetMatrix P = patch.jet.covariance();
  FitResult result;
  result.state.type = typeOf(jet, P, options);
  const PatchType type = result.state.type;
  constrainTo(type.surface, jet, P);
  const LocalSurface surface = surfaceOf(jet, patch.anchor);
  result.state.moments = momentsOf(patch, surface.tangent);
  result.state.curvature = surface.curvature;
  result.state.normal = surface.normal;
  result.state.centre = surface.centre;
  result.state_covariance =
      stateCovariance(type,
                      momentsCovariance(patch, surface.tangent),
                      surface.by_jet * P * surface.by_jet.transpose());
  const StateAxes axes = axesOf(result.state);
  const double bound = squaredBoundPerMoment(type.surface, options.containment);
  result.patch = patchOf(axes, bound);
  const StateMatrix to_axes = stateByAxes(axes).inverse();
  const StateMatrix in_axes = propagated<StateMatrix>(to_axes, result.state_covariance);
  result.covariance =
      propagated<ParameterMatrix>(parametersByAxes(axes, bound), in_axes);
  result.chi2 = patch.chi2;
  result.chi2_expected = patch.chi2_expected;
  result.chi2_dof = static_cast<int>(std::lround(std::max(0.0, patch.chi2_expected)));
  result.points = static_cast<int>(patch.moments[0]);
  judge(result);
  return result;
}

} // namespace holdfast
