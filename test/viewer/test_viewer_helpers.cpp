#include "support/organized_cloud.h"

#include <holdfast/pcl/visualization.h>

#include <gtest/gtest.h>

#include <vtkActor.h>

namespace holdfast { namespace {

using pcl::visualization::PCLVisualizer;
using test::makeCamera;

/// Patches of rolling ground.
std::vector<ExtractedPatch>
somePatches()
{
  const Camera camera = makeCamera(80, 60, 75.0);
  const RangeCloud cloud = test::makeOrganizedCloud(camera, [](int u, int v) {
    return 1.0 + 0.05 * std::sin(0.1 * u) * std::cos(0.1 * v);
  });
  ExtractionOptions options;
  options.sampler.radius_m = 0.1;
  options.keep_failures = true;
  return extractPatches(cloud, test::makeSensor(camera), options).patches;
}

/// Bounds of what a viewer shows under an id: lowest and highest z.
std::pair<double, double>
depthsOf(PCLVisualizer& viewer, const std::string& id)
{
  const auto found = viewer.getCloudActorMap()->find(id);
  if (found == viewer.getCloudActorMap()->end())
    return {0.0, 0.0};
  double bounds[6];
  found->second.actor->GetBounds(bounds);
  return {bounds[4], bounds[5]};
}

TEST(Viewer, TakesPatchesAndEllipsoids)
{
  const std::vector<ExtractedPatch> patches = somePatches();
  ASSERT_GT(acceptedAmong(patches).size(), 5U);
  PCLVisualizer viewer("holdfast", false);
  EXPECT_TRUE(addPatches(viewer, patches));
  EXPECT_TRUE(addEllipsoids(viewer, patches, "ellipsoids", 3.0, 20.0));
  EXPECT_TRUE(viewer.contains("patches"));
  EXPECT_TRUE(viewer.contains("ellipsoids"));
  const auto [near, far] = depthsOf(viewer, "patches");
  EXPECT_GT(near, 0.9);
  EXPECT_LT(far, 1.1);
  // Once more in the same place, and away.
  EXPECT_TRUE(addPatches(viewer, patches));
  EXPECT_TRUE(addPatches(viewer, {}));
  EXPECT_FALSE(viewer.contains("patches"));
  EXPECT_THROW(addPatches(viewer, patches, "bad", 0.0), std::invalid_argument);
}

TEST(Viewer, EllipsoidsHaveTheirSigmas)
{
  const Eigen::Vector3d centre(1.0, 2.0, 3.0), sigmas(0.1, 0.2, 0.3);
  const Eigen::Matrix3d radii = 2.0 * Eigen::Matrix3d(sigmas.asDiagonal());
  const Mesh mesh = detail::ellipsoidMesh(centre, radii);
  for (const Eigen::Vector3d& v : mesh.vertices)
    EXPECT_NEAR((v - centre).cwiseQuotient(sigmas).norm(), 2.0, 1e-12);
  for (const auto& [a, b, c] : mesh.triangles) {
    const auto at = [&](int i) { return mesh.vertices[static_cast<std::size_t>(i)]; };
    const Eigen::Vector3d normal = (at(b) - at(a)).cross(at(c) - at(a));
    EXPECT_GE(normal.dot(at(a) - centre), -1e-15) << "outward";
  }
}

}} // namespace holdfast
