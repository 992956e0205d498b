// Uses holdfast::core alone: fits a patch to a simulated bowl and checks what comes
// back, so that a mismatch of memory layouts between this program and the library shows
// as a wrong number or a crash.
#include <holdfast/patch/boundary.h>
#include <holdfast/patch/parameters.h>
#include <holdfast/patch/tessellation.h>
#include <holdfast/patch_estimator.h>
#include <holdfast/version.h>

#include <Eigen/Cholesky>

#include <cmath>
#include <cstdio>
#include <random>

namespace {

constexpr double kSigma = 1e-3; // m
constexpr double kDepth = 1.0; // m
constexpr double kCurvature = 5.0; // 1/m, positive: a bowl

/// A bowl one metre before a viewer at the origin, 31 x 31 points over 0.2 m.
void
fillWithBowl(holdfast::PointBatch& batch)
{
  std::mt19937_64 generator(1);
  std::normal_distribution<double> noise(0.0, kSigma);
  batch.clear({0.0, 0.0, kDepth});
  for (int row = -15; row <= 15; ++row)
    for (int column = -15; column <= 15; ++column) {
      const double x = 0.1 * column / 15;
      const double y = 0.1 * row / 15;
      const double z = kDepth - 0.5 * kCurvature * (x * x + y * y) + noise(generator);
      batch.add({x, y, z}, kSigma * kSigma * Eigen::Matrix3d::Identity());
    }
}

int failures = 0;

void
check(bool good, const char* what)
{
  if (!good) {
    std::printf("failed: %s\n", what);
    ++failures;
  }
}

} // namespace

int
main()
{
  holdfast::PointBatch batch;
  fillWithBowl(batch);
  holdfast::FitOptions options;
  options.surface = holdfast::SurfaceRequest::Paraboloid;
  const holdfast::FitResult result =
      holdfast::estimatePatch(batch, options, holdfast::CovarianceMode::Exact);

  check(holdfast::isUsable(result.status), "the fit is usable");
  check(result.points == 31 * 31, "all points are used");
  const int dof = holdfast::degreesOfFreedom(result.patch.type);
  check(result.covariance.rows() == dof, "the covariance has the size of its type");
  const Eigen::LLT<Eigen::MatrixXd> cholesky(Eigen::MatrixXd(result.covariance));
  check(cholesky.info() == Eigen::Success, "the covariance is positive definite");
  // The normal points to the viewer; the noise turns it by some 1e-4 rad.
  check(result.patch.normal().z() < -0.999, "the normal points to the viewer");
  // sigma_kappa is about 0.05 1/m here.
  const Eigen::Vector2d kappa = result.patch.principalCurvatures();
  check((kappa.array() - kCurvature).abs().maxCoeff() < 0.5,
        "the curvatures are found");
  check(holdfast::validityError(result.patch).empty(), "the patch is valid");

  const holdfast::ParameterVector parameters = holdfast::pack(result.patch);
  const holdfast::Patch again = holdfast::unpack(result.patch.type, parameters);
  check(holdfast::pack(again) == parameters, "packing and unpacking lose nothing");
  check(holdfast::projectedArea(result.patch) > 0.0, "the patch has an area");
  check(!holdfast::tessellate(result.patch, 0.02).triangles.empty(), "it has a mesh");

  std::printf("holdfast %s: %d failures\n", HOLDFAST_VERSION, failures);
  return failures;
}
