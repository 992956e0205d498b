// The mistakes that users of PCL make, one table of them for every class of ours: it is
// reported by PCL_ERROR, and what comes out is empty or NaN; nothing crashes or throws.
// The build with sanitizers runs this (test/sanitize.sh).
#include "support/organized_cloud.h"
#include "support/random.h"

#include <holdfast/pcl/conversions.h>
#include <holdfast/pcl/patch_estimation.h>
#include <holdfast/pcl/patch_segmentation.h>
#include <holdfast/pcl/range_covariance_estimation.h>

#include <pcl/common/point_tests.h>
#include <pcl/console/print.h>
#include <pcl/sample_consensus/ransac.h>
#include <pcl/search/kdtree.h>
#include <pcl/search/organized.h>

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <functional>
#include <initializer_list>
#include <limits>
#include <memory>
#include <ostream>
#include <string>
#include <vector>

namespace holdfast { namespace {

using test::kNaN;
using test::makeCamera;
using test::makeSensor;
using test::Random;
using Cloud = pcl::PointCloud<pcl::PointXYZ>;

const Camera kCamera = makeCamera(40, 30, 40.0);

/// A bowl with some noise.
Cloud::Ptr
soundCloud()
{
  Random random;
  const RangeCloud range = test::makeOrganizedCloud(kCamera, [&random](int u, int v) {
    return 1.0 - 0.0005 * (u - 20.0) * (u - 20.0) - 0.0005 * (v - 15.0) * (v - 15.0) +
           0.002 * random.normal();
  });
  return pcl::make_shared<Cloud>(*range.points);
}

Cloud::Ptr
copiesOf(const pcl::PointXYZ& point, std::size_t count)
{
  auto cloud = pcl::make_shared<Cloud>();
  cloud->resize(count, point);
  cloud->is_dense = pcl::isFinite(point);
  return cloud;
}

/// Everything that the user of one of our classes hands it.
struct Input {
  Cloud::Ptr cloud = soundCloud();
  pcl::IndicesPtr indices;
  CovariancesConstPtr covariances;
  NoiseModel::ConstPtr noise = makeSensor(kCamera).noise;
  double radius = 0.15;
  int k = 0;
  pcl::search::Search<pcl::PointXYZ>::Ptr search;
};

struct Mistake {
  std::string name;
  std::function<void(Input&)> make;
};

void
PrintTo(const Mistake& mistake, std::ostream* out)
{
  *out << mistake.name;
}

pcl::IndicesPtr
indices(std::initializer_list<int> list)
{
  return pcl::make_shared<pcl::Indices>(list);
}

std::vector<Mistake>
mistakesOfInput()
{
  const auto cloud = [](const std::string& name, const auto& make) {
    return Mistake{name, [make](Input& input) { input.cloud = make(); }};
  };
  const auto index = [](const std::string& name, int wrong) {
    return Mistake{name, [wrong](Input& input) {
                     input.indices = indices({0, 1, 2, 3, 4, 5, 6, 7, wrong});
                   }};
  };
  return {cloud("no_input", [] { return Cloud::Ptr(); }),
          cloud("empty_cloud", [] { return pcl::make_shared<Cloud>(); }),
          cloud("all_nan",
                [] {
                  return copiesOf({kNaN, kNaN, kNaN}, 100);
                }),
          cloud("all_infinite",
                [] {
                  const float inf = std::numeric_limits<float>::infinity();
                  return copiesOf({inf, inf, inf}, 100);
                }),
          cloud("width_times_height_is_not_size",
                [] {
                  auto crooked = soundCloud();
                  crooked->width = 7;
                  return crooked;
                }),
          index("index_negative", -1),
          index("index_one_too_large", 40 * 30),
          index("index_huge", std::numeric_limits<int>::max())};
}

/// Not for segmentation: no indices at all mean all points to PCL's consensus models,
/// and to ours.
Mistake
noIndices()
{
  return {"no_indices", [](Input& input) { input.indices = indices({}); }};
}

/// Input that measures nothing that a surface could be fitted to.
std::vector<Mistake>
mistakesOfFitting()
{
  std::vector<Mistake> mistakes = mistakesOfInput();
  const auto covariances = [](const std::string& name, std::size_t count, float value) {
    return Mistake{name, [=](Input& input) {
                     input.covariances = std::make_shared<const Covariances>(
                         count,
                         Eigen::Matrix3f(value * Eigen::Matrix3f::Identity()));
                   }};
  };
  mistakes.insert(mistakes.end(),
                  {{"one_point",
                    [](Input& input) {
                      input.cloud = copiesOf({0, 0, 1}, 1);
                    }},
                   {"duplicates",
                    [](Input& input) {
                      input.cloud = copiesOf({0.1F, 0, 1}, 500);
                    }},
                   {"behind_the_sensor",
                    [](Input& input) {
                      input.cloud = copiesOf({0.1F, 0, -1}, 500);
                    }},
                   covariances("covariances_too_few", 17, 1e-6F),
                   covariances("covariances_too_many", 40 * 30 + 1, 1e-6F),
                   covariances("covariances_nan", 40 * 30, kNaN),
                   covariances("covariances_negative", 40 * 30, -1e-6F)});
  return mistakes;
}

std::vector<Mistake>
mistakesOfNeighborhoods()
{
  std::vector<Mistake> mistakes = mistakesOfFitting();
  const auto size = [](const std::string& name, double radius, int k) {
    return Mistake{name, [=](Input& input) {
                     input.radius = radius;
                     input.k = k;
                   }};
  };
  mistakes.insert(
      mistakes.end(),
      {noIndices(),
       size("radius_and_k", 0.1, 50),
       size("negative_radius", -0.1, 0),
       size("nan_radius", std::nan(""), 0),
       size("negative_k", 0.0, -5),
       {"no_noise", [](Input& input) { input.noise = nullptr; }},
       {"organized_search_of_an_unorganized_cloud", [](Input& input) {
          input.cloud->width = 40 * 30;
          input.cloud->height = 1;
          input.search =
              pcl::make_shared<pcl::search::OrganizedNeighbor<pcl::PointXYZ>>();
        }}});
  return mistakes;
}

/// Errors are wanted here, and not on the screen.
class PclMisuse : public testing::TestWithParam<Mistake> {
protected:
  PclMisuse()
  {
    pcl::console::setVerbosityLevel(pcl::console::L_ALWAYS);
    GetParam().make(input_);
  }
  ~PclMisuse() override
  {
    pcl::console::setVerbosityLevel(pcl::console::L_INFO);
  }

  /// Into any of our classes and PCL's.
  template <typename Estimation>
  void give(Estimation& estimation) const
  {
    if (input_.cloud)
      estimation.setInputCloud(input_.cloud);
    if (input_.indices)
      estimation.setIndices(input_.indices);
    estimation.setNoiseModel(input_.noise);
  }

  Input input_;
};

std::string
nameOf(const testing::TestParamInfo<Mistake>& info)
{
  return info.param.name;
}

template <typename PointT>
void
expectNothing(const pcl::PointCloud<PointT>& cloud)
{
  EXPECT_TRUE(cloud.empty() || !cloud.is_dense);
  for (const PointT& point : cloud)
    EXPECT_FALSE(pcl::isFinite(point));
}

Mistake
noMistake()
{
  return {"none", [](Input&) {}};
}

// ---- Covariances

class CovarianceMisuse : public PclMisuse {
protected:
  pcl::PointCloud<PointXYZCovariance> compute(Covariances& beside)
  {
    RangeCovarianceEstimation<pcl::PointXYZ> estimation;
    give(estimation);
    estimation.computeCovariances(beside);
    pcl::PointCloud<PointXYZCovariance> inside(4, 3);
    estimation.compute(inside);
    return inside;
  }
};

class CovarianceUse : public CovarianceMisuse {};

TEST_P(CovarianceMisuse, GivesNone)
{
  Covariances beside(3, Eigen::Matrix3f::Identity());
  expectNothing(compute(beside));
  for (const Eigen::Matrix3f& Sigma : beside)
    EXPECT_FALSE(Sigma.allFinite());
}

TEST_P(CovarianceUse, GivesAll)
{
  Covariances beside;
  EXPECT_TRUE(compute(beside).is_dense);
  EXPECT_EQ(beside.size(), input_.cloud->size());
}

INSTANTIATE_TEST_SUITE_P(All,
                         CovarianceMisuse,
                         testing::ValuesIn(mistakesOfInput()),
                         nameOf);
INSTANTIATE_TEST_SUITE_P(All, CovarianceUse, testing::Values(noMistake()), nameOf);

// ---- Patches

class PatchMisuse : public PclMisuse {
protected:
  pcl::PointCloud<PatchPoint> compute(
      const pcl::search::Search<pcl::PointXYZ>::Ptr& search) const
  {
    PatchEstimation<pcl::PointXYZ> estimation;
    give(estimation);
    estimation.setInputCovariances(input_.covariances);
    estimation.setRadiusSearch(input_.radius);
    estimation.setKSearch(input_.k);
    if (search)
      estimation.setSearchMethod(search);
    pcl::PointCloud<PatchPoint> patches(4, 3);
    estimation.compute(patches);
    return patches;
  }

  static pcl::search::Search<pcl::PointXYZ>::Ptr tree()
  {
    return pcl::make_shared<pcl::search::KdTree<pcl::PointXYZ>>();
  }
};

class PatchUse : public PatchMisuse {};

TEST_P(PatchMisuse, GivesNone)
{
  if (input_.search)
    expectNothing(compute(input_.search));
  else
    for (const auto& search : {decltype(input_.search)(), tree()})
      expectNothing(compute(search));
}

TEST_P(PatchUse, GivesAll)
{
  for (const auto& search : {decltype(input_.search)(), tree()})
    EXPECT_TRUE(compute(search).is_dense);
}

INSTANTIATE_TEST_SUITE_P(All,
                         PatchMisuse,
                         testing::ValuesIn(mistakesOfNeighborhoods()),
                         nameOf);
INSTANTIATE_TEST_SUITE_P(All, PatchUse, testing::Values(noMistake()), nameOf);

// ---- Consensus

class SegmentationMisuse : public PclMisuse {
protected:
  FitResult segment(int model, int method, pcl::PointIndices& inliers) const
  {
    PatchSegmentation<pcl::PointXYZ> segmentation;
    give(segmentation);
    segmentation.setInputCovariances(input_.covariances);
    segmentation.setModelType(model);
    segmentation.setMethodType(method);
    segmentation.setSigmaThreshold(3.0);
    segmentation.setMaxIterations(20); // LMedS makes them all
    pcl::ModelCoefficients coefficients;
    segmentation.segment(inliers, coefficients);
    return segmentation.getPatch();
  }
};

class SegmentationUse : public SegmentationMisuse {};

constexpr std::array kModels{int{pcl::SACMODEL_PLANE},
                             int{pcl::SACMODEL_SPHERE},
                             int{pcl::SACMODEL_CYLINDER},
                             int{SACMODEL_PATCH}};

TEST_P(SegmentationMisuse, GivesNone)
{
  for (const int method :
       {pcl::SAC_RANSAC, pcl::SAC_MSAC, pcl::SAC_LMEDS, pcl::SAC_PROSAC})
    for (const int model : kModels) {
      pcl::PointIndices inliers;
      inliers.indices = {0};
      EXPECT_FALSE(isUsable(segment(model, method, inliers).status));
      EXPECT_TRUE(inliers.indices.empty());
    }
}

TEST_P(SegmentationUse, GivesSome)
{
  for (const int model : kModels) {
    pcl::PointIndices inliers;
    segment(model, pcl::SAC_RANSAC, inliers);
    EXPECT_FALSE(inliers.indices.empty());
  }
}

INSTANTIATE_TEST_SUITE_P(All,
                         SegmentationMisuse,
                         testing::ValuesIn(mistakesOfFitting()),
                         nameOf);
INSTANTIATE_TEST_SUITE_P(All, SegmentationUse, testing::Values(noMistake()), nameOf);

}} // namespace holdfast
