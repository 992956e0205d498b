// Patches of whole simulated clouds whose pixels share errors, about the true surface.
#include "support/kinect_pattern.h"
#include "support/organized_cloud.h"
#include "support/random.h"

#include <holdfast/patch/surface.h>
#include <holdfast/pcl/patch_extraction.h>
#include <holdfast/simulation/simulator.h>

#include <Eigen/Geometry>
#include <Eigen/LU>

#include <cmath>

namespace holdfast { namespace {

using test::Random;

Sensor
kinectWithPattern()
{
  Sensor sensor = test::makeSensor(test::makeCamera(640, 480, 575.8));
  sensor.pattern = test::kinectPattern();
  return sensor;
}

// The plane z = 0, 1.1 m away and tilted by 0.4 rad.
Scene
planeScene()
{
  Scene scene;
  scene.name = "plane";
  scene.shapes = {std::make_shared<Terrain>(Eigen::Vector3d::Zero(), 8.0, 0.0, 1.0, 1)};
  const Eigen::Vector3d from(1.1 * std::sin(0.4), 0.0, 1.1 * std::cos(0.4));
  scene.sensor_pose = lookAt(from, {0, 0, 0}, {0, 1, 0});
  return scene;
}

RangeCloud
cloudOf(const RangeImage& image)
{
  auto points = pcl::make_shared<pcl::PointCloud<pcl::PointXYZ>>(
      static_cast<std::uint32_t>(image.width),
      static_cast<std::uint32_t>(image.height));
  for (std::size_t i = 0; i < image.points.size(); ++i)
    (*points)[i].getVector3fMap() = image.points[i].cast<float>();
  RangeCloud cloud;
  cloud.points = points;
  cloud.sensor_pose = image.sensor_pose;
  cloud.sensor_pose_given = true;
  return cloud;
}

// 3 rows of 4 pixels, 150 px apart: more than two and a half lengths of the long wave.
std::vector<int>
pixelsFarApart(const Camera& camera)
{
  std::vector<int> indices;
  for (int v = 90; v < camera.height; v += 150)
    for (int u = 95; u < camera.width; u += 150)
      indices.push_back(v * camera.width + u);
  return indices;
}

// NEES of the normal and of the height at the patch's centre about the plane z = 0.
double
normalizedError(const FitResult& fit)
{
  const ParameterLayout layout = layoutOf(fit.patch.type);
  const ParameterMatrix tangent = toTangent(fit.patch, fit.covariance);
  const Eigen::Matrix3d R = fit.patch.pose().R;
  const Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  Eigen::MatrixXd J = Eigen::MatrixXd::Zero(3, tangent.rows());
  J(0, layout.r()) = 1.0;
  J(1, layout.r() + 1) = 1.0;
  J.block<1, 3>(2, layout.c()) = up.transpose();
  // R exp(delta) turns the normal to R (delta_y, -delta_x, 1).
  const Eigen::Vector3d normal = R.transpose() * up;
  const Eigen::Vector3d error(-normal.y(), normal.x(), -fit.patch.pose().c.z());
  return error.dot((J * tangent * J.transpose()).inverse() * error);
}

struct Nees {
  double sum = 0.0;
  int patches = 0;

  double perDof() const
  {
    return sum / (3.0 * patches);
  }
};

void
fitInto(Nees& nees, const RangeCloud& cloud, const Sensor& sensor)
{
  ExtractionOptions options;
  options.sampler.radius_m = 0.04;
  options.fit.surface = SurfaceRequest::Plane;
  options.fit.plane_boundary = BoundaryType::Circle;
  options.threads = 1;
  options.validation.reset(); // nothing is selected by what is judged
  NeighborhoodSampler sampler(cloud, sensor, options.sampler);
  PatchSites sites;
  sites.seeds = seedsAt(cloud, pixelsFarApart(sensor.camera));
  const auto scratch = sampler.makeScratch();
  sites.search = [&](const Seed& seed, int, std::vector<int>& indices) {
    sampler.neighborhood(seed.index, *scratch, indices);
  };
  const ExtractionResult result = extractPatches(cloud, sensor, options, sites);
  EXPECT_EQ(result.patches.size(), sites.seeds->size());
  for (const ExtractedPatch& patch : result.patches) {
    nees.sum += normalizedError(patch.fit);
    ++nees.patches;
  }
}

// Patches of one image 150 px apart share at most exp(-150^2 / (2 56^2)) = 0.028 of the
// long wave: their NEES, by its square, nothing that counts. So the sum over all is
// chi-square with three degrees of freedom a patch, of relative standard deviation
// sqrt(2 / (3 n)). Four of those, and 0.03 for the sums over cells (test_pattern.cpp).
TEST(PatternExtraction, CovariancesHoldOnSimulatedClouds)
{
  Random random;
  const Sensor sensor = kinectWithPattern();
  constexpr int kImages = 20;
  RangeImage image = castRays(planeScene(), pixelRays(sensor.camera));
  attachNoise(image, sensor);
  Nees with, without;
  for (int i = 0; i < kImages; ++i) {
    drawNoise(image, random.engine(), image.points);
    const RangeCloud cloud = cloudOf(image);
    fitInto(with, cloud, sensor);
    fitInto(without, cloud, withoutPattern(sensor));
  }
  ASSERT_EQ(with.patches, 12 * kImages);
  const double sigma = std::sqrt(2.0 / (3.0 * with.patches));
  EXPECT_NEAR(with.perDof(), 1.0, 4.0 * sigma + 0.03);
  EXPECT_GT(without.perDof(), 10.0);
}

// And independent noise is not what a pattern's covariances are for.
TEST(PatternExtraction, IndependentNoiseIsBelowThem)
{
  Random random;
  const Sensor sensor = kinectWithPattern();
  RangeImage image = castRays(planeScene(), pixelRays(sensor.camera));
  attachNoise(image, withoutPattern(sensor));
  Nees with, without;
  for (int i = 0; i < 8; ++i) {
    drawNoise(image, random.engine(), image.points);
    const RangeCloud cloud = cloudOf(image);
    fitInto(with, cloud, sensor);
    fitInto(without, cloud, withoutPattern(sensor));
  }
  const double sigma = std::sqrt(2.0 / (3.0 * without.patches));
  EXPECT_NEAR(without.perDof(), 1.0, 4.0 * sigma);
  EXPECT_LT(with.perDof(), 0.2);
}

}} // namespace holdfast
