#include <holdfast/contact/contact_risk.h>

#include <holdfast/geometry/gaussian.h>

#include <Eigen/Cholesky>

#include <algorithm>
#include <cmath>

namespace holdfast {
namespace {

/// Covariance of xx xy yy for second derivatives of variance one.
Eigen::Matrix3d
unitSecondDerivatives()
{
  Eigen::Matrix3d S;
  S << 1.0, 0.0, 1.0 / 3.0, 0.0, 1.0 / 3.0, 0.0, 1.0 / 3.0, 0.0, 1.0;
  return S;
}

/// Derivative of the log-likelihood of all curvatures by the logarithm of their prior's
/// variance: sum of tr(S^-1 B (S^-1 k k^T - I)) / 2 with S = variance * B + P.
double
scoreOf(const std::vector<MapPatch>& patches, double variance)
{
  const Eigen::Matrix3d B = variance * unitSecondDerivatives();
  double score = 0.0;
  for (const MapPatch& patch : patches) {
    const Eigen::Vector3d k = patch.jet.value().tail<3>();
    const Eigen::LLT<Eigen::Matrix3d> S(
        B + patch.jet.covariance().bottomRightCorner<3, 3>());
    const Eigen::Vector3d a = S.solve(k);
    score += a.dot(B * a) - S.solve(B).trace();
  }
  return 0.5 * score;
}

} // namespace

SurfacePrior
surfacePriorOf(const PatchMap& map)
{
  SurfacePrior prior;
  const std::vector<MapPatch>& patches = map.patches();
  if (patches.empty())
    return prior;
  // From flatter than any camera tells to as bent as a finger, by bisection.
  double low = std::log(1e-3), high = std::log(300.0);
  constexpr int kSteps = 20; // to 1e-5 of the logarithm
  for (int i = 0; i < kSteps; ++i) {
    const double middle = 0.5 * (low + high);
    (scoreOf(patches, std::exp(2.0 * middle)) > 0.0 ? low : high) = middle;
  }
  prior.curvature_per_m = std::exp(0.5 * (low + high));
  return prior;
}

ContactSurface
contactSurfaceOf(const PatchMap& map, const MapPatch& patch, const SurfacePrior& prior)
{
  ContactSurface surface;
  surface.jet = {patch.jet.value(), patch.jet.covariance(), JetMatrix::Zero()};
  if (std::isfinite(prior.curvature_per_m)) {
    // The prior says that the curvatures are zero, give or take.
    const JetMatrix P = surface.jet.white;
    const Eigen::LLT<Eigen::Matrix3d> S(prior.curvature_per_m * prior.curvature_per_m *
                                            unitSecondDerivatives() +
                                        P.bottomRightCorner<3, 3>());
    const Eigen::Matrix<double, 6, 3> gain = S.solve(P.bottomRows<3>()).transpose();
    surface.jet.value -= gain * patch.jet.value().tail<3>();
    surface.jet.white = symmetrized(JetMatrix(P - gain * P.bottomRows<3>()));
  }
  surface.anchor = patch.anchor;
  surface.support = patch.support;
  surface.radius_m = patch.radius_m;
  surface.s3_per_m2 = map.roughnessOf(patch);
  return surface;
}

} // namespace holdfast
