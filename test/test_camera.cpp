#include <holdfast/simulation/simulator.h>

#include "support/random.h"

#include <Eigen/LU>

#include <cmath>

namespace holdfast { namespace {

// A few products of numbers of order 1000.
constexpr double kRounding = 1e-12;

TEST(Camera, ProjectionInvertsBackProjection)
{
  test::Random random;
  Camera camera;
  camera.fy = 560.0;
  for (int i = 0; i < 100; ++i) {
    const double u = random.uniform(-10.0, 650.0);
    const double v = random.uniform(-10.0, 490.0);
    const double depth = random.uniform(0.1, 10.0);
    const Eigen::Vector3d q = camera.backProject(u, v, depth);
    EXPECT_EQ(q.z(), depth);
    EXPECT_NEAR((camera.project(q) - Eigen::Vector2d(u, v)).norm(), 0.0, 1e-10);
  }
}

TEST(Camera, PixelRaysPassThroughTheirPixels)
{
  const Camera camera;
  for (const int stride : {1, 6, 7, 1000}) {
    const RayGrid rays = pixelRays(camera, stride);
    EXPECT_EQ(rays.width, (camera.width - 1) / stride + 1);
    EXPECT_EQ(rays.height, (camera.height - 1) / stride + 1);
    ASSERT_EQ(rays.directions.size(),
              static_cast<std::size_t>(rays.width) *
                  static_cast<std::size_t>(rays.height));
    for (std::size_t i = 0; i < rays.directions.size(); i += 97) {
      const int column = static_cast<int>(i) % rays.width;
      const int row = static_cast<int>(i) / rays.width;
      EXPECT_EQ(rays.directions[i].z(), 1.0);
      EXPECT_NEAR((camera.project(rays.directions[i]) -
                   Eigen::Vector2d(column * stride, row * stride))
                      .norm(),
                  0.0,
                  1e-10);
    }
  }
  EXPECT_THROW(pixelRays(camera, 0), std::invalid_argument);
}

TEST(Camera, FrustumRaysGoThroughCellMiddles)
{
  const double fov = std::acos(-1.0) / 3.0;
  const RayGrid rays = frustumRays(30, fov);
  ASSERT_EQ(rays.directions.size(), 900u);
  const double edge = std::tan(fov / 2.0) * 29.0 / 30.0;
  EXPECT_NEAR((rays.directions.front() - Eigen::Vector3d(-edge, -edge, 1.0)).norm(),
              0.0,
              kRounding);
  EXPECT_NEAR((rays.directions.back() - Eigen::Vector3d(edge, edge, 1.0)).norm(),
              0.0,
              kRounding);
  EXPECT_NEAR(rays.directions[1].x() - rays.directions[0].x(),
              2.0 * edge / 29.0,
              kRounding);
  EXPECT_EQ(rays.directions[1].y(), rays.directions[0].y());
  EXPECT_THROW(frustumRays(0, fov), std::invalid_argument);
  EXPECT_THROW(frustumRays(3, 0.0), std::invalid_argument);
  EXPECT_THROW(frustumRays(3, 3.2), std::invalid_argument);
  EXPECT_THROW(frustumRays(3, std::nan("")), std::invalid_argument);
}

TEST(Camera, LookAtPutsTheTargetAheadAndUpAbove)
{
  test::Random random;
  for (int i = 0; i < 100; ++i) {
    const Eigen::Vector3d position = random.uniformVector(-3.0, 3.0);
    const Eigen::Vector3d target = random.uniformVector(-3.0, 3.0);
    const Eigen::Vector3d up = random.unitVector();
    const Pose pose = lookAt(position, target, up);
    EXPECT_NEAR((pose.R.transpose() * pose.R - Eigen::Matrix3d::Identity()).norm(),
                0.0,
                kRounding);
    EXPECT_NEAR(pose.R.determinant(), 1.0, kRounding);
    const Eigen::Vector3d seen = pose.toLocal(target);
    EXPECT_NEAR(seen.head<2>().norm(), 0.0, kRounding);
    EXPECT_NEAR(seen.z(), (target - position).norm(), kRounding);
    const Eigen::Vector3d up_seen = pose.R.transpose() * up;
    EXPECT_NEAR(up_seen.x(), 0.0, kRounding);
    EXPECT_LT(up_seen.y(), 0.0) << "rows count downwards";
  }
}

TEST(Camera, LookAtRefusesWhatHasNoAnswer)
{
  const Eigen::Vector3d p(1.0, 2.0, 3.0);
  EXPECT_THROW(lookAt(p, p, Eigen::Vector3d::UnitX()), std::invalid_argument);
  EXPECT_THROW(lookAt(p, 2.0 * p, p), std::invalid_argument);
  EXPECT_THROW(lookAt(p, 2.0 * p, Eigen::Vector3d::Zero()), std::invalid_argument);
}

}} // namespace holdfast
