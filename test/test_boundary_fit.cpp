// The bounds of stages II-4 to II-9 as a function of surface and moments, and its
// Jacobian, which the covariance of every type rests on.
#include "support/finite_difference.h"
#include "support/patch_batch.h"
#include "support/random_patch.h"

#include "fit/boundary_fit.h"
#include "geometry/symmetric.h"
#include <holdfast/geometry/constants.h>
#include <holdfast/geometry/rotation.h>

#include <Eigen/Eigenvalues>

#include <boost/math/special_functions/erf.hpp>

namespace holdfast { namespace {

using kernel::Model;
using test::Random;

constexpr double kContainment = 0.95;

Model
modelOf(SurfaceType surface)
{
  return isParaboloid(surface)          ? Model::Paraboloid :
         surface == SurfaceType::Plane  ? Model::Plane :
         surface == SurfaceType::Sphere ? Model::Sphere :
                                          Model::Cylinder;
}

// What boundPatch() takes, with the plane stage where it has one.
struct Input {
  PatchType type;
  UnboundedSurface surface;
  Scatter scatter;
  bool has_plane = false;
  UnboundedSurface plane;
  bool smooth = true;

  BoundedPatch bound() const
  {
    return boundPatch(
        {type, surface, scatter, has_plane ? &plane : nullptr, {0.7, -1.1, 0.4}},
        {squaredBoundPerMoment(SurfaceType::EllipticParaboloid, kContainment),
         squaredBoundPerMoment(SurfaceType::Plane, kContainment),
         smooth});
  }
};

// Axes of the scatter, normal on the side of `up`.
void
findAxes(Scatter& scatter, const Eigen::Vector3d& up)
{
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(scatter.covariance);
  scatter.eigenvalues = solver.eigenvalues();
  const Eigen::Vector3d n = solver.eigenvectors().col(0);
  scatter.axes.col(2) = n.dot(up) < 0.0 ? Eigen::Vector3d(-n) : n;
  scatter.axes.col(0) = solver.eigenvectors().col(2);
  scatter.axes.col(1) = scatter.axes.col(2).cross(scatter.axes.col(0));
}

// A frame turned by some 0.1 rad.
Eigen::Matrix3d
nearby(const Eigen::Matrix3d& R, Random& random)
{
  return R * expMap(random.uniformVector(-0.15, 0.15));
}

// Points of 4-10 cm extent about a surface of curvature 2-6 1/m, all at random.
Input
randomInput(PatchType type, Model model, Random& random)
{
  Input in;
  in.type = type;
  in.surface.model = model;
  in.surface.R = random.rotation();
  // In braces the numbers are drawn in their order, whatever the compiler.
  const Eigen::Vector3d k{random.uniform(2.0, 3.5),
                          random.uniform(-1.0, 1.0),
                          random.uniform(4.5, 6.0)};
  const Eigen::Vector3d signs{random.sign(), 1.0, random.sign()};
  in.surface.k = signs.cwiseProduct(k);
  const Eigen::Vector3d sigma{random.uniform(0.07, 0.1),
                              random.uniform(0.04, 0.06),
                              random.uniform(0.005, 0.01)};
  const Eigen::Matrix3d near_surface = nearby(in.surface.R, random);
  const Eigen::Matrix3d axes =
      near_surface * expMap({0.0, 0.0, random.uniform(-3.0, 3.0)});
  in.scatter.count = 100;
  in.scatter.mean = random.uniformVector(-0.2, 0.2);
  in.scatter.covariance = axes * sigma.cwiseAbs2().asDiagonal() * axes.transpose();
  findAxes(in.scatter, in.surface.R.col(2));
  in.surface.a = random.uniform(-0.02, 0.02);
  in.surface.c =
      model == Model::Paraboloid ?
          Eigen::Vector3d(in.scatter.mean + in.surface.a * in.scatter.normal()) :
          Eigen::Vector3d(in.scatter.mean + random.uniformVector(-0.02, 0.02));
  in.plane.model = Model::Plane;
  in.plane.R = nearby(in.surface.R, random);
  in.plane.c = in.scatter.mean;
  return in;
}

using Joint = Eigen::Matrix<double, JointLayout::kSize, 1>;

// The input moved by the joint variables, in the axes of the surface's frame, as the
// solver's parameters are defined.
Input
moved(const Input& in, const Joint& joint)
{
  Input out = in;
  const Eigen::Matrix3d& R = in.surface.R;
  out.scatter.mean += R * joint.segment<3>(JointLayout::kMean);
  const auto s = joint.segment<6>(JointLayout::kScatter);
  const Eigen::Matrix3d dC = symmetric::matrixOf(s);
  out.scatter.covariance += R * dC * R.transpose();
  findAxes(out.scatter, in.scatter.normal());
  const auto theta = joint.head<6>();
  Eigen::Vector3d delta = Eigen::Vector3d::Zero();
  switch (in.surface.model) {
  case Model::Paraboloid:
    out.surface.k += theta.head<3>();
    delta.head<2>() = theta.segment<2>(3);
    out.surface.a += theta[5];
    out.surface.c = out.scatter.mean + out.surface.a * out.scatter.normal();
    break;
  case Model::Sphere:
    out.surface.k[0] += theta[0];
    out.surface.c += R * theta.segment<3>(1);
    break;
  case Model::Cylinder:
    out.surface.k[0] += theta[0];
    delta.tail<2>() = theta.segment<2>(1);
    out.surface.c += R * Eigen::Vector3d(0.0, theta[3], theta[4]);
    break;
  case Model::Plane:
    delta.head<2>() = theta.head<2>();
    out.surface.c += R * Eigen::Vector3d(0.0, 0.0, theta[2]);
    break;
  }
  out.surface.R = R * expMap(delta);
  const auto plane = joint.segment<3>(JointLayout::kPlane);
  out.plane.R = in.plane.R * expMap({plane[0], plane[1], 0.0});
  out.plane.c += in.plane.R * Eigen::Vector3d(0.0, 0.0, plane[2]);
  return out;
}

// Change of each joint variable that changes a patch of 0.1 m noticeably.
Joint
jointScale(Model model)
{
  Joint scale;
  scale.head<6>() =
      model == Model::Paraboloid ?
          (Eigen::Matrix<double, 6, 1>() << 1, 1, 1, 0.1, 0.1, 0.01).finished() :
      model == Model::Sphere ?
          (Eigen::Matrix<double, 6, 1>() << 1, 0.01, 0.01, 0.01, 1, 1).finished() :
      model == Model::Cylinder ?
          (Eigen::Matrix<double, 6, 1>() << 1, 0.1, 0.1, 0.01, 0.01, 1).finished() :
          (Eigen::Matrix<double, 6, 1>() << 0.1, 0.1, 0.01, 1, 1, 1).finished();
  scale.segment<3>(JointLayout::kMean).setConstant(0.01);
  scale.segment<6>(JointLayout::kScatter).setConstant(1e-4);
  scale.segment<3>(JointLayout::kPlane) << 0.1, 0.1, 0.01;
  return scale;
}

// The differences' own error: h^4 of a smooth function in units of its scale, h = 0.01,
// times some tens for the fifth derivatives.
constexpr double kTolerance = 1e-6;

void
expectRows(const Eigen::MatrixXd& actual, const Eigen::MatrixXd& expected)
{
  for (Eigen::Index row = 0; row < expected.rows(); ++row)
    EXPECT_LT((actual.row(row) - expected.row(row)).cwiseAbs().maxCoeff(),
              kTolerance * (expected.row(row).cwiseAbs().maxCoeff()))
        << "row " << row << "\n"
        << actual.row(row) << "\n"
        << expected.row(row);
}

// Of the state, and of the parameters through it.
void
expectJacobian(const Input& in)
{
  const BoundedPatch bounded = in.bound();
  const Joint scale = jointScale(in.surface.model);
  const auto at = [&](const Eigen::VectorXd& x) {
    return moved(in, scale.cwiseProduct(Joint(x))).bound();
  };
  const auto derivative = [](const auto& function) -> Eigen::MatrixXd {
    return test::numericalJacobian(function,
                                   Eigen::VectorXd::Zero(JointLayout::kSize),
                                   1e-2);
  };
  const Eigen::MatrixXd in_axes = bounded.jacobian * scale.asDiagonal();
  expectRows(stateByAxes(bounded.axes) * in_axes,
             derivative([&](const Eigen::VectorXd& x) -> Eigen::VectorXd {
               return difference(at(x).state, bounded.state);
             }));
  // The chart of r is cut at pi: differences across are none.
  constexpr double kFarFromCut = 0.05;
  if (kPi - bounded.patch.r.norm() < kFarFromCut)
    return;
  expectRows(parametersByAxes(bounded.axes, bounded.squared_bound) * in_axes,
             derivative([&](const Eigen::VectorXd& x) -> Eigen::VectorXd {
               return pack(at(x).patch);
             }));
}

constexpr std::uint64_t kCases = 20;

class BoundaryFit : public testing::TestWithParam<PatchType> {};

TEST_P(BoundaryFit, JacobianIsTheDerivativeOfThePatch)
{
  const PatchType type = GetParam();
  const Model model = modelOf(type.surface);
  for (std::uint64_t i = 0; i < kCases; ++i) {
    Random random(i);
    Input in = randomInput(type, model, random);
    in.smooth = i % 2 == 0;
    in.has_plane = (model == Model::Sphere || model == Model::Cylinder) && i % 4 < 2;
    expectJacobian(in);
  }
}

TEST_P(BoundaryFit, PatchIsValidAndOnTheSurface)
{
  const Model model = modelOf(GetParam().surface);
  for (std::uint64_t i = 0; i < kCases; ++i) {
    Random random(i);
    const Input in = randomInput(GetParam(), model, random);
    const BoundedPatch bounded = in.bound();
    if (bounded.status == FitStatus::CurvatureSignMismatch)
      continue;
    ASSERT_EQ(bounded.status, FitStatus::Converged);
    EXPECT_EQ(validityError(bounded.patch), "");
    const Patch again = canonical(bounded.patch);
    EXPECT_LT((pack(again) - pack(bounded.patch)).cwiseAbs().maxCoeff(), 1e-12);
    EXPECT_EQ(parametersByAxes(bounded.axes, bounded.squared_bound).rows(),
              degreesOfFreedom(GetParam()));
  }
}

INSTANTIATE_TEST_SUITE_P(AllTypes,
                         BoundaryFit,
                         testing::ValuesIn(kPatchTypes),
                         test::patchTypeName);

// A plane that the type tests made of a paraboloid keeps the paraboloid's parameters.
TEST(BoundaryFitOfParaboloid, JacobianIsTheDerivativeOfThePlane)
{
  for (const PatchType type : kPatchTypes)
    for (std::uint64_t i = 0; i < kCases && type.surface == SurfaceType::Plane; ++i) {
      SCOPED_TRACE(test::typeName(type));
      Random random(i);
      expectJacobian(randomInput(type, Model::Paraboloid, random));
    }
}

TEST(SquaredBoundPerMoment, EnclosesTheShareOfAGaussian)
{
  for (const double share : {0.5, 0.9, 0.95, 0.999}) {
    // Within so many sigmas on a line; within as many of a plane's centre.
    const double line = squaredBoundPerMoment(SurfaceType::Sphere, share);
    EXPECT_NEAR(boost::math::erf(std::sqrt(0.5 * line)), share, 1e-14);
    const double plane = squaredBoundPerMoment(SurfaceType::Plane, share);
    EXPECT_NEAR(1.0 - std::exp(-0.5 * plane), share, 1e-14);
  }
}

TEST(BoundaryFitStatus, SignsThatContradictTheTypeAreReported)
{
  Random random;
  for (const auto& [surface, sign] :
       {std::pair(SurfaceType::EllipticParaboloid, -1.0),
        std::pair(SurfaceType::HyperbolicParaboloid, 1.0)}) {
    Input in = randomInput({surface, BoundaryType::Ellipse}, Model::Paraboloid, random);
    in.surface.k = Eigen::Vector3d(sign * 3.0, 0.0, 5.0);
    EXPECT_EQ(in.bound().status, FitStatus::CurvatureSignMismatch);
    in.surface.k = Eigen::Vector3d(-sign * 3.0, 0.0, 5.0);
    EXPECT_EQ(in.bound().status, FitStatus::Converged);
  }
}

TEST(BoundaryFitStatus, ANormalAlongTheCylindersAxisLeavesNoDirectionForZ)
{
  Random random;
  Input in = randomInput({SurfaceType::CircularCylinder, BoundaryType::Rectangle},
                         Model::Cylinder,
                         random);
  in.has_plane = true;
  in.plane.R = in.surface.R * expMap({0.0, 1.5707963267948966, 0.0});
  EXPECT_EQ(in.bound().status, FitStatus::Degenerate);
}

TEST(BoundaryFitStatus, ANormalOppositeToTheWorldsZIsKeptOffTheSingularity)
{
  for (const PatchType type :
       {PatchType{SurfaceType::CircularParaboloid, BoundaryType::Circle},
        PatchType{SurfaceType::Plane, BoundaryType::Circle}})
    for (const double angle : {0.0, 1e-16, 1e-12, 1e-9, 9e-7, 1.1e-6}) {
      Random random;
      Input in = randomInput(type, modelOf(type.surface), random);
      const Eigen::Vector3d axis = random.unitVector();
      in.surface.R = expMap({3.141592653589793, 0.0, 0.0}) * expMap(angle * axis);
      const BoundedPatch bounded = in.bound();
      EXPECT_EQ(bounded.status, FitStatus::Converged) << angle;
      EXPECT_TRUE(bounded.jacobian.allFinite()) << angle;
      EXPECT_TRUE(parametersByAxes(bounded.axes, bounded.squared_bound).allFinite())
          << angle;
      EXPECT_LT((bounded.patch.normal() - in.surface.R.col(2)).norm(), 2.0 * kRxyMargin)
          << angle;
    }
}

}} // namespace holdfast
