// Contact risk as a PCL feature: that it says what contactRisk() says.
#include "support/random.h"

#include <holdfast/contact/foothold.h>
#include <holdfast/io/foot_file.h>
#include <holdfast/pcl/contact_risk_estimation.h>
#include <holdfast/pcl/conversions.h>
#include <holdfast/sensor/constant_noise_model.h>

#include <pcl/common/point_tests.h>
#include <pcl/console/print.h>
#include <pcl/filters/filter.h>

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace holdfast { namespace {

using test::Random;
using Patches = pcl::PointCloud<PatchPoint>;
using Footholds = pcl::PointCloud<FootholdPoint>;

/// Bumps and hollows at random places, as PatchEstimation leaves them.
Patches::Ptr
makePatches(Random& random, int count)
{
  std::vector<ExtractedPatch> patches;
  for (int i = 0; i < count; ++i) {
    // Points of a quadric above the ground, seen from above.
    auto points = pcl::make_shared<pcl::PointCloud<pcl::PointXYZ>>();
    const double kx = random.uniform(-6.0, 3.0), ky = random.uniform(-6.0, 3.0);
    const double gx = random.uniform(-0.4, 0.4), gy = random.uniform(-0.4, 0.4);
    for (int n = 0; n < 300; ++n) {
      const double r = 0.06 * std::sqrt(random.uniform(0.0, 1.0));
      const double a = random.uniform(-3.14159, 3.14159);
      const double x = r * std::cos(a), y = r * std::sin(a);
      const double z = gx * x + gy * y + 0.5 * (kx * x * x + ky * y * y);
      points->emplace_back(static_cast<float>(x),
                           static_cast<float>(y),
                           static_cast<float>(z + 0.001 * random.normal()));
    }
    RangeCloud cloud;
    cloud.points = points;
    cloud.covariances = std::make_shared<const Covariances>(
        points->size(),
        Eigen::Matrix3f(Eigen::Vector3f(1e-8F, 1e-8F, 1e-6F).asDiagonal()));
    cloud.sensor_pose.R = Eigen::Vector3d(1.0, -1.0, -1.0).asDiagonal();
    cloud.sensor_pose.c.z() = 1.0;
    cloud.sensor_pose_given = true;
    ExtractionOptions options;
    options.validation.reset();
    options.threads = 1;
    Sensor sensor;
    sensor.noise =
        std::make_shared<ConstantNoiseModel>(ConstantNoiseModel::Parameters());
    ExtractionResult result = extractWhole(cloud, sensor, options);
    for (ExtractedPatch& patch : result.patches)
      patches.push_back(patch);
  }
  Pose sensor;
  sensor.c.z() = 1.0;
  auto cloud = pcl::make_shared<Patches>(toPatchCloud(patches, sensor));
  return cloud;
}

TEST(ContactRiskEstimation, SaysWhatContactRiskSays)
{
  Random random;
  const auto patches = makePatches(random, 30);
  ASSERT_EQ(patches->size(), 30u);
  const Foot foot = rectangularFoot(0.05, 0.03);
  ContactRiskEstimation estimation;
  estimation.setInputCloud(patches);
  estimation.setFoot(foot);
  estimation.setNumberOfYaws(8);
  Footholds footholds;
  estimation.compute(footholds);
  ASSERT_EQ(footholds.size(), patches->size());
  int found = 0;
  for (std::size_t i = 0; i < footholds.size(); ++i) {
    const FootholdPoint& point = footholds[i];
    EXPECT_EQ(point.patch, static_cast<int>(i));
    const FitResult fit = toExtractedPatch((*patches)[i]).fit;
    Placement placement;
    placement.point = fit.patch.c;
    placement.yaw = static_cast<double>(point.yaw);
    const ContactRisk risk = contactRisk(fit, foot, placement);
    EXPECT_EQ(point.status, static_cast<int>(risk.status));
    if (!risk.quality) {
      EXPECT_FALSE(pcl::isFinite(point));
      continue;
    }
    ++found;
    const ContactQuality& quality = *risk.quality;
    EXPECT_NEAR(point.total, quality.risk.total, 1e-4);
    EXPECT_NEAR(point.slip, quality.risk.slip, 1e-4);
    EXPECT_NEAR(point.gap, quality.risk.gap, 1e-4);
    EXPECT_NEAR(point.support, quality.risk.support, 1e-6);
    EXPECT_NEAR(point.contact_area, quality.contact_area_m2, 1e-6);
    EXPECT_NEAR((point.getVector3fMap().cast<double>() - quality.pose.c).norm(),
                0,
                1e-6);
    const Eigen::Quaternionf q(point.orientation[0],
                               point.orientation[1],
                               point.orientation[2],
                               point.orientation[3]);
    EXPECT_NEAR((q.toRotationMatrix().cast<double>() - quality.pose.R).norm(), 0, 1e-5);
    EXPECT_NEAR(point.pose_covariance[20], quality.pose_covariance(5, 5), 1e-9);
    // The best yaw: no other one is better.
    placement.yaw = 0.0;
    for (const ContactRisk& other :
         contactRisks(*contactSurfaceOf(fit), foot, placement, 8))
      if (other.quality) {
        EXPECT_GE(other.quality->risk.total, quality.risk.total - 1e-4);
      }
  }
  EXPECT_GT(found, 15);
}

TEST(ContactRiskEstimation, KeepsIndicesAndLeavesOutWhatIsNoPatch)
{
  Random random;
  const auto patches = makePatches(random, 6);
  ASSERT_EQ(patches->size(), 6u);
  (*patches)[2] = toPatchPoint(ExtractedPatch()); // no patch was found
  (*patches)[3].surface = 200; // of no type
  ContactRiskEstimation estimation;
  estimation.setInputCloud(patches);
  estimation.setFoot(rectangularFoot(0.02, 0.02));
  const auto indices = pcl::make_shared<pcl::Indices>(pcl::Indices{5, 2, 3, 0});
  estimation.setIndices(indices);
  Footholds footholds;
  estimation.compute(footholds);
  ASSERT_EQ(footholds.size(), 4u);
  EXPECT_EQ(footholds[0].patch, 5);
  EXPECT_EQ(footholds[3].patch, 0);
  EXPECT_FALSE(footholds.is_dense);
  for (const std::size_t i : {1u, 2u}) {
    EXPECT_TRUE(std::isnan(footholds[i].total));
    EXPECT_EQ(footholds[i].support, 1.0F);
    EXPECT_EQ(footholds[i].status,
              static_cast<int>(ContactStatus::InsufficientSupport));
  }
  // PCL's own tools take the points.
  pcl::Indices kept;
  Footholds finite;
  pcl::removeNaNFromPointCloud(footholds, finite, kept);
  EXPECT_LE(finite.size(), 2u);
}

TEST(ContactRiskEstimation, ReportsMisuseAndThrowsNothing)
{
  pcl::console::setVerbosityLevel(pcl::console::L_ALWAYS);
  Random random;
  const auto patches = makePatches(random, 2);
  const auto computed = [&](const Foot& foot, const Eigen::Vector3d& load, int yaws) {
    ContactRiskEstimation estimation;
    estimation.setInputCloud(patches);
    estimation.setFoot(foot);
    estimation.setLoadDirection(load);
    estimation.setNumberOfYaws(yaws);
    Footholds footholds;
    estimation.compute(footholds);
    return footholds.size();
  };
  const Foot foot = rectangularFoot(0.03, 0.02);
  const Eigen::Vector3d down = -Eigen::Vector3d::UnitZ();
  EXPECT_EQ(computed(foot, down, 4), 2u);
  EXPECT_EQ(computed(Foot(), down, 4), 0u);
  EXPECT_EQ(computed(foot, Eigen::Vector3d::Zero(), 4), 0u);
  EXPECT_EQ(computed(foot, down, 0), 0u);
  Foot slippery = foot;
  slippery.friction.mean = -1.0;
  EXPECT_EQ(computed(slippery, down, 4), 0u);
  ContactRiskEstimation empty;
  empty.setFoot(foot);
  Footholds footholds;
  empty.compute(footholds);
  EXPECT_TRUE(footholds.empty());
}

}} // namespace holdfast
