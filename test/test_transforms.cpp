#include "support/patch_batch.h"
#include "support/random_patch.h"
#include "support/small_clouds.h"

#include <holdfast/geometry/gaussian.h>
#include <holdfast/patch_estimator.h>
#include <holdfast/pcl/conversions.h>
#include <holdfast/pcl/transforms.h>

#include <pcl/common/transforms.h>

#include <gtest/gtest.h>

#include <cstring>

namespace holdfast { namespace {

using test::Random;

Eigen::Isometry3d
isometry(const Pose& T)
{
  Eigen::Isometry3d transform = Eigen::Isometry3d::Identity();
  transform.linear() = T.R;
  transform.translation() = T.c;
  return transform;
}

FitResult
fitTo(const test::Sample& sample, PatchType type, CovarianceMode mode)
{
  PointBatch batch = test::batchOf(sample);
  FitOptions options = test::optionsFor(type);
  return estimatePatch(batch, options, mode);
}

class EveryType : public testing::TestWithParam<PatchType> {};
INSTANTIATE_TEST_SUITE_P(Transforms,
                         EveryType,
                         testing::ValuesIn(kPatchTypes),
                         test::patchTypeName);

/// Parameters and covariance of the moved fit are those of the fit to the moved points.
TEST_P(EveryType, MovingAFitIsFittingMovedPoints)
{
  for (std::uint64_t i = 0; i < 8; ++i) {
    Random random(i);
    const test::Sample sample = test::robotSample(GetParam(), 1.0, random);
    const Pose T = test::randomPose(random);
    const FitResult fit = fitTo(sample, GetParam(), CovarianceMode::Exact);
    ASSERT_TRUE(isUsable(fit.status));
    const FitResult expected =
        fitTo(transformed(sample, T), GetParam(), CovarianceMode::Exact);
    const FitResult moved = transformed(fit, T);
    ASSERT_EQ(moved.status, expected.status);
    // Each fit stops within 1e-6 sigma of the optimum, and its covariance is right to
    // some times that (polish_tolerance_sigma).
    const Eigen::VectorXd sigma = expected.covariance.diagonal().cwiseSqrt();
    EXPECT_LT((pack(moved.patch) - pack(expected.patch))
                  .cwiseAbs()
                  .cwiseQuotient(sigma)
                  .maxCoeff(),
              1e-5);
    EXPECT_LT(test::normalizedDifference(moved.covariance, expected.covariance), 1e-5);
  }
}

TEST_P(EveryType, BackAndForthIsWhereItWas)
{
  Random random;
  const test::Sample sample = test::robotSample(GetParam(), 1.0, random);
  const FitResult fit = fitTo(sample, GetParam(), CovarianceMode::SecondOrder);
  const Pose T = test::randomPose(random);
  const FitResult back = transformed(transformed(fit, T), T.inverse());
  EXPECT_LT((pack(back.patch) - pack(fit.patch)).norm(), 1e-12);
  // Rounding, enlarged by charts near their singularity.
  EXPECT_LT(test::normalizedDifference(back.covariance, fit.covariance), 1e-9);
  EXPECT_LT((*back.mean_shift - *fit.mean_shift).norm(), 1e-9 * fit.mean_shift->norm());
}

TEST_P(EveryType, PointsMoveAsTheirPatchesDo)
{
  Random random;
  ExtractedPatch patch;
  patch.fit = fitTo(test::robotSample(GetParam(), 1.0, random),
                    GetParam(),
                    CovarianceMode::Exact);
  ExtractedPatch failed;
  failed.fit.status = FitStatus::Degenerate;
  const Pose T = test::randomPose(random);
  const auto cloud = toPatchCloud({patch, failed}, {});
  pcl::PointCloud<PatchPoint> moved;
  transformPatches(cloud, moved, isometry(T));
  ASSERT_EQ(moved.size(), 2U);
  EXPECT_FALSE(moved.is_dense);
  EXPECT_TRUE(std::isnan(moved[1].x));
  pcl::PointCloud<PatchPoint> by_pcl;
  pcl::transformPointCloudWithNormals(cloud, by_pcl, isometry(T).cast<float>());
  // Rotations in single precision.
  EXPECT_LT((moved[0].getVector3fMap() - by_pcl[0].getVector3fMap()).norm(), 1e-6F);
  EXPECT_LT((moved[0].getNormalVector3fMap() - by_pcl[0].getNormalVector3fMap()).norm(),
            1e-6F);
  EXPECT_TRUE(moved.sensor_origin_.head<3>().isApprox(T.c.cast<float>()));
  const FitResult expected = transformed(patch.fit, T);
  EXPECT_LT(test::normalizedDifference(toExtractedPatch(moved[0]).fit.covariance,
                                       expected.covariance),
            1e-3);
}

TEST(TransformedFits, StayUsableWhereTheChartIsSingular)
{
  FitResult fit;
  fit.status = FitStatus::Converged;
  fit.patch.type = {SurfaceType::Plane, BoundaryType::Circle};
  fit.patch.d(0) = 0.1;
  fit.covariance = 1e-6 * ParameterMatrix::Identity(6, 6);
  Pose upside_down;
  upside_down.R.diagonal() << 1.0, -1.0, -1.0;
  const FitResult moved = transformed(fit, upside_down);
  EXPECT_EQ(moved.status, FitStatus::Converged);
  EXPECT_LT((moved.patch.normal() + Eigen::Vector3d::UnitZ()).norm(), 2e-6);
  ASSERT_TRUE(moved.covariance.allFinite());
  // The isotropic covariance of the normal is what it was.
  const ParameterMatrix tangent = toTangent(moved.patch, moved.covariance);
  EXPECT_LT((tangent - fit.covariance).cwiseAbs().maxCoeff(), 1e-9);
}

/// The covariance of transformed samples is the transformed covariance.
TEST(PointCovariances, RotateAsSamplesDo)
{
  Random random;
  const Pose T = test::randomPose(random);
  const RangeCloud bowl = test::bowlCloud(8, 6, test::tiltedPose(), true);
  const auto cloud = toPointCloud(bowl);
  pcl::PointCloud<PointXYZCovariance> moved;
  transformPointCloudWithCovariances(cloud, moved, isometry(T));

  const Eigen::Matrix3d Sigma = cloud[20].getCovarianceMatrix().cast<double>();
  const Eigen::Matrix3d root = squareRoot(Sigma);
  constexpr int kSamples = 20000;
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (int i = 0; i < kSamples; ++i) {
    const Eigen::Vector3d e = T.R * (root * random.normalVector());
    scatter += e * e.transpose() / kSamples;
  }
  const Eigen::Matrix3d rotated = moved[20].getCovarianceMatrix().cast<double>();
  // A variance from n samples is known to sqrt(2/n) = 1 %; five times that.
  EXPECT_LT((scatter - rotated).norm(), 0.05 * Sigma.norm());
  EXPECT_GT((Sigma - rotated).norm(), 0.1 * Sigma.norm());
}

TEST(PointCovariances, MoveWithPositionsAsPclMovesThem)
{
  Random random;
  const Pose T = test::randomPose(random);
  const RangeCloud bowl = test::bowlCloud(8, 6, test::tiltedPose(), true);
  auto cloud = toPointCloud(bowl);
  pcl::PointCloud<PointXYZCovariance> by_pcl, moved;
  pcl::transformPointCloud(cloud, by_pcl, isometry(T).cast<float>());
  transformPointCloudWithCovariances(cloud, moved, isometry(T));
  const Covariances beside = transformCovariances(*bowl.covariances, isometry(T));
  for (std::size_t i = 1; i < cloud.size(); ++i) {
    EXPECT_EQ(moved[i].getVector3fMap(), by_pcl[i].getVector3fMap());
    EXPECT_EQ(by_pcl[i].getCovarianceMatrix(),
              (*bowl.covariances)[i]); // PCL's does not
    EXPECT_LT((moved[i].getCovarianceMatrix() - beside[i]).norm(),
              1e-6F * beside[i].norm());
  }
  // The sensor stands where it stood, seen from the points.
  const Pose pose = sensorPose(moved.sensor_origin_, moved.sensor_orientation_);
  EXPECT_TRUE(pose.c.isApprox(T.toWorld(bowl.sensor_pose.c), 1e-6));
  EXPECT_TRUE(pose.R.isApprox(T.R * bowl.sensor_pose.R, 1e-6));

  transformPointCloudWithCovariances(cloud, cloud, isometry(T)); // in place
  EXPECT_EQ(cloud[20].getCovarianceMatrix(), moved[20].getCovarianceMatrix());
  EXPECT_EQ(cloud[20].getVector3fMap(), moved[20].getVector3fMap());
}

}} // namespace holdfast
