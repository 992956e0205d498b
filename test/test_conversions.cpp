#include "support/random_patch.h"
#include "support/small_clouds.h"

#include <holdfast/geometry/constants.h>
#include <holdfast/io/patch_io.h>
#include <holdfast/pcl/conversions.h>
#include <holdfast/validation/names.h>

#include <gtest/gtest.h>

#include <cstring>
#include <sstream>

namespace holdfast { namespace {

using test::Random;

ExtractedPatch
randomExtracted(Random& random, PatchType type)
{
  ExtractedPatch extracted;
  FitResult& fit = extracted.fit;
  fit.status = FitStatus::Converged;
  fit.patch = test::randomPatch(random, type);
  const int n = degreesOfFreedom(type);
  fit.covariance.resize(n, n);
  for (int i = 0; i < n; ++i)
    for (int j = 0; j <= i; ++j)
      fit.covariance(i, j) = fit.covariance(j, i) = 1e-5 * random.normal();
  fit.state = toState(fit.patch, FitOptions{}.containment);
  const Eigen::Index m = stateLayoutOf(type).size();
  fit.state_covariance.resize(m, m);
  for (Eigen::Index i = 0; i < m; ++i)
    for (Eigen::Index j = 0; j <= i; ++j)
      fit.state_covariance(i, j) = fit.state_covariance(j, i) = 1e-5 * random.normal();
  // Of a cylinder it would leave entries out.
  fit.flags.curvature_not_observable = type.surface == SurfaceType::Sphere;
  fit.nonlinearity = random.uniform(0.0, 0.1);
  fit.chi2 = random.uniform(50.0, 150.0);
  fit.chi2_dof = 94;
  fit.chi2_expected = 83.5;
  fit.points = 100;
  Validation& validation = extracted.validation.emplace();
  validation.verdict = PatchVerdict::Accepted;
  validation.residual.rms_m = random.uniform(0.0, 0.01);
  validation.coverage.share = random.uniform(0.5, 1.0);
  extracted.seed_index = 4711;
  extracted.radius_m = 0.05;
  return extracted;
}

/// Half a unit in the last place of a float.
constexpr double kFloatRounding = 6e-8;

class EveryType : public testing::TestWithParam<PatchType> {};
INSTANTIATE_TEST_SUITE_P(Conversions,
                         EveryType,
                         testing::ValuesIn(kPatchTypes),
                         test::patchTypeName);

TEST_P(EveryType, PatchComesBackFromItsPointToTheRoundingOfFloats)
{
  Random random;
  const ExtractedPatch patch = randomExtracted(random, GetParam());
  const ExtractedPatch back = toExtractedPatch(toPatchPoint(patch));
  const FitResult& a = patch.fit;
  const FitResult& b = back.fit;
  EXPECT_EQ(a.patch.type, b.patch.type);
  EXPECT_EQ(validityError(b.patch), "");
  EXPECT_EQ(a.status, b.status);
  EXPECT_EQ(a.points, b.points);
  EXPECT_EQ(a.chi2_dof, b.chi2_dof);
  EXPECT_EQ(patch.seed_index, back.seed_index);
  EXPECT_EQ(back.validation->verdict, PatchVerdict::Accepted);
  EXPECT_NEAR(a.chi2, b.chi2, kFloatRounding * a.chi2);
  EXPECT_NEAR(patch.validation->coverage.share,
              back.validation->coverage.share,
              kFloatRounding);
  EXPECT_TRUE((pack(a.patch) - pack(b.patch))
                  .cwiseAbs()
                  .cwiseQuotient(pack(a.patch).cwiseAbs())
                  .maxCoeff() <= kFloatRounding);
  EXPECT_TRUE((a.covariance - b.covariance)
                  .cwiseAbs()
                  .cwiseQuotient(a.covariance.cwiseAbs())
                  .maxCoeff() <= kFloatRounding);
}

/// Bit for bit, but for the normal: the one in a point is that of the patch before its
/// orientation was rounded.
bool
sameBytes(PatchPoint a, const PatchPoint& b)
{
  const Eigen::Vector3f turn = a.getNormalVector3fMap() - b.getNormalVector3fMap();
  if (turn.norm() > 3 * kFloatRounding * kPi)
    return false;
  a.getNormalVector3fMap() = b.getNormalVector3fMap();
  return std::memcmp(&a, &b, offsetof(PatchPoint, verdict) + 1) == 0;
}

TEST_P(EveryType, PointSurvivesTheWayThroughPatchAndJsonBitForBit)
{
  Random random;
  const PatchPoint point = toPatchPoint(randomExtracted(random, GetParam()));
  EXPECT_TRUE(sameBytes(point, toPatchPoint(toExtractedPatch(point))));
  PatchReport report;
  report.result.patches.push_back(toExtractedPatch(point));
  std::ostringstream text;
  writeJson(text, report, JsonLayout::OneLine);
  EXPECT_TRUE(sameBytes(point, toPatchPoint(readJson(text.str()).result.patches[0])));
}

TEST_P(EveryType, PointHasPositionAndNormalOfItsPatch)
{
  Random random;
  const ExtractedPatch patch = randomExtracted(random, GetParam());
  const PatchPoint point = toPatchPoint(patch);
  EXPECT_EQ(point.getVector3fMap(), patch.fit.patch.c.cast<float>());
  EXPECT_EQ(point.getNormalVector3fMap(), patch.fit.patch.normal().cast<float>());
}

TEST(PatchPoints, KeepRotationsByPiWithinBounds)
{
  ExtractedPatch patch;
  patch.fit.status = FitStatus::Converged;
  patch.fit.patch.d.head<2>() << 0.1, 0.1;
  patch.fit.patch.r = kPi * Eigen::Vector3d(1.0, 2.0, -2.0) / 3.0;
  patch.fit.covariance = 1e-6 * ParameterMatrix::Identity(8, 8);
  const ExtractedPatch back = toExtractedPatch(toPatchPoint(patch));
  EXPECT_EQ(validityError(back.fit.patch), "");
}

TEST(PatchPoints, OfPatchesNotAcceptedAreNaNAndSayWhy)
{
  Random random;
  ExtractedPatch failed;
  failed.fit.status = FitStatus::Degenerate;
  failed.fit.points = 5;
  ExtractedPatch turned_down = randomExtracted(random, kPatchTypes[0]);
  turned_down.validation->verdict = PatchVerdict::CoverageTooLow;
  for (const ExtractedPatch& patch : {failed, turned_down}) {
    const PatchPoint point = toPatchPoint(patch);
    EXPECT_TRUE(point.getArray3fMap().isNaN().all());
    EXPECT_TRUE(std::isnan(point.normal_x) && std::isnan(point.parameters[10]) &&
                std::isnan(point.parameter_covariance[65]));
    EXPECT_EQ(point.points, patch.fit.points);
    const ExtractedPatch back = toExtractedPatch(point);
    EXPECT_FALSE(isAccepted(back));
    EXPECT_EQ(back.fit.status, patch.fit.status);
    EXPECT_TRUE(sameBytes(point, toPatchPoint(back)));
  }
  const PatchPoint point = toPatchPoint(turned_down);
  EXPECT_EQ(point.verdict, static_cast<int>(PatchVerdict::CoverageTooLow));
  EXPECT_FALSE(std::isnan(point.coverage));
  EXPECT_EQ(toPatchPoint(failed).verdict, static_cast<int>(PatchVerdict::NotUsable));
  EXPECT_FALSE(toPatchCloud({turned_down}, {}).is_dense);
}

TEST(PatchPoints, KeepEveryVerdict)
{
  Random random;
  ExtractedPatch patch = randomExtracted(random, kPatchTypes[0]);
  for (int i = 0; i < static_cast<int>(kVerdictNames.words.size()); ++i) {
    patch.validation->verdict = static_cast<PatchVerdict>(i);
    EXPECT_EQ(toExtractedPatch(toPatchPoint(patch)).validation->verdict,
              patch.validation->verdict);
  }
}

TEST(PatchPoints, ThatAreNoneThrow)
{
  PatchPoint sphere_in_a_quad;
  sphere_in_a_quad.surface = static_cast<std::uint8_t>(SurfaceType::Sphere);
  sphere_in_a_quad.boundary = static_cast<std::uint8_t>(BoundaryType::Quad);
  EXPECT_THROW(toExtractedPatch(sphere_in_a_quad), std::invalid_argument);
  PatchPoint unknown_status;
  unknown_status.status = 200;
  EXPECT_THROW(toExtractedPatch(unknown_status), std::invalid_argument);
  PatchPoint unknown_surface;
  unknown_surface.surface = 99;
  EXPECT_THROW(toExtractedPatch(unknown_surface), std::invalid_argument);
}

template <typename PointT>
class EveryInput : public testing::Test {};
using InputTypes = testing::Types<pcl::PointXYZ,
                                  pcl::PointXYZI,
                                  pcl::PointXYZRGB,
                                  pcl::PointXYZRGBA,
                                  pcl::PointNormal,
                                  PointXYZCovariance>;
TYPED_TEST_SUITE(EveryInput, InputTypes);

TYPED_TEST(EveryInput, KeepsPointsGridAndSensorPose)
{
  const RangeCloud bowl = test::bowlCloud(16, 12, test::tiltedPose());
  auto cloud = pcl::make_shared<pcl::PointCloud<TypeParam>>();
  pcl::copyPointCloud(*bowl.points, *cloud);
  writeSensorPose(bowl.sensor_pose, *cloud);
  const RangeCloud range = toRangeCloud<TypeParam>(cloud);
  EXPECT_EQ(range.points->width, 16U);
  EXPECT_EQ(range.points->height, 12U);
  EXPECT_TRUE(std::isnan((*range.points)[0].x));
  for (std::size_t i = 1; i < cloud->size(); ++i)
    ASSERT_EQ((*range.points)[i].getVector3fMap(), (*bowl.points)[i].getVector3fMap());
  // The pose went through a quaternion of floats.
  EXPECT_TRUE(range.sensor_pose.R.isApprox(bowl.sensor_pose.R, 1e-6));
  EXPECT_TRUE(range.sensor_pose.c.isApprox(bowl.sensor_pose.c, 1e-6));
}

TEST(RangeClouds, OfPlainPointsShareThem)
{
  const RangeCloud bowl = test::bowlCloud(16, 12);
  EXPECT_EQ(toRangeCloud<pcl::PointXYZ>(bowl.points).points, bowl.points);
}

TEST(RangeClouds, ExchangeCovariancesWithPoints)
{
  const RangeCloud bowl = test::bowlCloud(16, 12, test::tiltedPose(), true);
  const auto points = toPointCloud(bowl).makeShared();
  EXPECT_EQ(*toRangeCloud<PointXYZCovariance>(points).covariances, *bowl.covariances);
  const auto without = toPointCloud(test::bowlCloud(16, 12));
  EXPECT_TRUE(std::isnan(without[5].covariance[0]));
}

TEST(RangeClouds, DoNotBelieveASensorPoseThatThePointsContradict)
{
  const auto points =
      pcl::make_shared<pcl::PointCloud<pcl::PointXYZ>>(*test::bowlCloud(40, 30).points);
  // What many files of PCL carry although their points are in the camera frame.
  points->sensor_orientation_ = Eigen::Quaternionf(0.0F, 1.0F, 0.0F, 0.0F);
  std::string notice;
  const RangeCloud range = toRangeCloud<pcl::PointXYZ>(points, &notice);
  EXPECT_TRUE(range.sensor_pose.R.isIdentity(0.0));
  EXPECT_FALSE(notice.empty());
  points->sensor_orientation_.coeffs().setZero(); // no rotation at all
  EXPECT_TRUE(toRangeCloud<pcl::PointXYZ>(points).sensor_pose.R.isIdentity(0.0));
}

}} // namespace holdfast
