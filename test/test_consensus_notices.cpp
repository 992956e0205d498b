// Sample consensus says in which unit its threshold is, and doubts numbers and clouds
// of another one: nothing is wrong in silence.
#include "support/organized_cloud.h"
#include "support/random.h"

#include <holdfast/pcl/patch_segmentation.h>
#include <holdfast/validation/residual.h>

#include <pcl/console/print.h>
#include <pcl/sample_consensus/ransac.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <ostream>
#include <sstream>
#include <string>
#include <vector>

namespace holdfast { namespace {

using test::kNaN;
using test::makeCamera;
using test::makeSensor;
using test::Random;
using Cloud = pcl::PointCloud<pcl::PointXYZ>;
using Segmentation = PatchSegmentation<pcl::PointXYZ>;
using Model = SampleConsensusModelPatch<pcl::PointXYZ>;

const Camera kCamera = makeCamera(80, 60, 80.0);

/// Of a Kinect at 1 m.
constexpr double kNoise = 0.004;

/// A ball of 15 cm radius in the middle of a wall 1.2 m away, with a Kinect's noise.
Cloud::Ptr
ballBeforeWall()
{
  Random random;
  const RangeCloud range = test::makeOrganizedCloud(kCamera, [&](int u, int v) {
    constexpr double kWall = 1.2, kRadius = 0.15;
    const Eigen::Vector3d ray = kCamera.backProject(u, v, 1.0);
    // |t ray - (0, 0, wall)|^2 = radius^2
    const double a = ray.squaredNorm();
    const double root = kWall * kWall - a * (kWall * kWall - kRadius * kRadius);
    const double depth = root > 0.0 ? (kWall - std::sqrt(root)) / a : kWall;
    return depth + kNoise * depth * depth * random.normal();
  });
  return pcl::make_shared<Cloud>(*range.points);
}

Cloud::Ptr
scaled(const Cloud& cloud, float factor)
{
  auto result = pcl::make_shared<Cloud>(cloud);
  for (pcl::PointXYZ& point : *result)
    point.getVector3fMap() *= factor;
  return result;
}

/// What a user sets.
struct Use {
  Cloud::Ptr cloud = ballBeforeWall();
  Segmentation segmentation;

  Use()
  {
    segmentation.setSensor(makeSensor(kCamera));
    segmentation.setModelType(pcl::SACMODEL_SPHERE);
    segmentation.setMethodType(pcl::SAC_RANSAC);
    segmentation.setMaxIterations(200);
    segmentation.setRadiusLimits(0.05, 0.5);
  }

  std::vector<std::string> notices(pcl::PointIndices& inliers)
  {
    pcl::ModelCoefficients coefficients;
    segmentation.setInputCloud(cloud);
    segmentation.segment(inliers, coefficients);
    return segmentation.getNotices();
  }
};

struct Mistake {
  std::string name;
  std::function<void(Use&)> make;
  /// All in one of the notices.
  std::vector<std::string> words;
  /// It finds nothing, and says so with the cloud's extent and spacing.
  bool finds_nothing = false;
};

void
PrintTo(const Mistake& mistake, std::ostream* out)
{
  *out << mistake.name;
}

void
unorganize(Cloud& cloud)
{
  cloud.width = static_cast<std::uint32_t>(cloud.size());
  cloud.height = 1;
}

std::vector<Mistake>
mistakesOfThresholds()
{
  return {
      {"metres_for_sigmas",
       [](Use& use) { use.segmentation.setSigmaThreshold(0.01); },
       {"0.01 sigmas", "0.798 %", "2 to 5 sigmas are expected", "metres"}},
      {"millimetres_for_sigmas",
       [](Use& use) { use.segmentation.setSigmaThreshold(100.0); },
       {"100 sigmas", "expected", "millimetres"}},
      {"sigmas_for_metres",
       [](Use& use) { use.segmentation.setDistanceThreshold(3.0); },
       {"3 m", "times the noise", "expected", "sigmas"}},
      {"sigmas_for_metres_without_noise",
       [](Use& use) {
         use.segmentation.setNoiseModel(nullptr);
         use.segmentation.setDistanceThreshold(3.0);
       },
       {"3 m", "extent", "expected", "sigmas"}},
      {"metres_below_the_noise",
       [](Use& use) { use.segmentation.setDistanceThreshold(1e-4); },
       {"0.0001 m", "noise", "expected"}},
      {"negative_metres",
       [](Use& use) { use.segmentation.setDistanceThreshold(-1.0); },
       {"-1 m", "keeps no point"},
       true},
      {"no_sigmas",
       [](Use& use) { use.segmentation.setSigmaThreshold(0.0); },
       {"0 sigmas", "keeps no point"},
       true},
      {"nan",
       [](Use& use) { use.segmentation.setSigmaThreshold(std::nan("")); },
       {"nan sigmas", "keeps no point"},
       true},
      {"sigmas_without_noise",
       [](Use& use) {
         use.segmentation.setNoiseModel(nullptr);
         use.segmentation.setSigmaThreshold(3.0);
       },
       {"sigmas", "noise", "setDistanceThreshold"}},
      {"neither_threshold_nor_noise",
       [](Use& use) { use.segmentation.setNoiseModel(nullptr); },
       {"no threshold", "setDistanceThreshold", "expected"}},
      {"sigmas_for_a_model_of_pcl",
       [](Use& use) {
         use.segmentation.setModelType(pcl::SACMODEL_LINE);
         use.segmentation.setSigmaThreshold(3.0);
       },
       {"no sigmas", "expected"}},
  };
}

std::vector<Mistake>
mistakesOfClouds()
{
  const auto inUnit = [](float per_metre) {
    return [per_metre](Use& use) { use.cloud = scaled(*use.cloud, per_metre); };
  };
  return {
      {"millimetres", inUnit(1e3F), {"image", "expected", "millimetres"}},
      {"centimetres_and_no_radius_fits",
       inUnit(1e2F),
       {"image", "expected", "millimetres"}},
      {"unorganized_millimetres",
       [inUnit](Use& use) {
         inUnit(1e3F)(use);
         unorganize(*use.cloud);
       },
       {"noise", "expected", "millimetres"}},
      {"unorganized_millimetres_without_noise",
       [inUnit](Use& use) {
         inUnit(1e3F)(use);
         unorganize(*use.cloud);
         use.segmentation.setNoiseModel(nullptr);
         use.segmentation.setDistanceThreshold(0.01);
       },
       {"threshold", "expected", "millimetres"}},
      {"all_nan",
       [](Use& use) {
         for (pcl::PointXYZ& point : *use.cloud)
           point = {kNaN, kNaN, kNaN};
       },
       {"none of the 4800 points is finite"}},
      {"two_points",
       [](Use& use) {
         for (std::size_t i = 2; i < use.cloud->size(); ++i)
           (*use.cloud)[i] = {kNaN, kNaN, kNaN};
       },
       {"takes 4 points, but 2 of the 4800 points are finite"}},
      {"behind_the_camera",
       [inUnit](Use& use) { inUnit(-1.0F)(use); },
       {"no point has a usable covariance", "sensor"},
       true},
  };
}

std::vector<Mistake>
mistakesOfRadii()
{
  const auto limits = [](double least, double most) {
    return [=](Use& use) { use.segmentation.setRadiusLimits(least, most); };
  };
  return {
      {"radii_in_millimetres",
       limits(20.0, 120.0),
       // A wall is a ball of 20 m, too.
       {"20 m", "larger than the cloud", "expected", "millimetres"}},
      {"radii_below_the_spacing",
       limits(1e-9, 2e-9),
       {"2e-09 m", "distance between points", "expected"},
       true},
      {"radii_exchanged", limits(0.5, 0.05), {"0.5 m to 0.05 m", "no radius"}, true}};
}

class ConsensusMistake : public testing::TestWithParam<Mistake> {
protected:
  ConsensusMistake()
  {
    pcl::console::setVerbosityLevel(pcl::console::L_ALWAYS);
  }
  ~ConsensusMistake() override
  {
    pcl::console::setVerbosityLevel(pcl::console::L_INFO);
  }
};

std::string
joined(const std::vector<std::string>& notices)
{
  std::string text;
  for (const std::string& notice : notices)
    text += notice + '\n';
  return text;
}

bool
holdsAll(const std::string& notice, const std::vector<std::string>& words)
{
  return std::all_of(words.begin(), words.end(), [&notice](const auto& word) {
    return notice.find(word) != std::string::npos;
  });
}

TEST_P(ConsensusMistake, IsSaid)
{
  Use use;
  GetParam().make(use);
  pcl::PointIndices inliers;
  const std::vector<std::string> notices = use.notices(inliers);
  EXPECT_TRUE(std::any_of(notices.begin(), notices.end(), [](const auto& notice) {
    return holdsAll(notice, GetParam().words);
  })) << joined(notices);
  for (const std::string& notice : notices)
    EXPECT_EQ(notice.find('\n'), std::string::npos) << notice;
  if (!GetParam().finds_nothing)
    return;
  EXPECT_TRUE(inliers.indices.empty());
  ASSERT_FALSE(notices.empty());
  EXPECT_TRUE(holdsAll(
      notices.back(),
      {"no patch", "4800 of 4800 points are valid", "m apart", "likely cause"}))
      << notices.back();
}

template <typename Instance>
std::string
nameOf(const Instance& info)
{
  return info.param.name;
}

INSTANTIATE_TEST_SUITE_P(OfThresholds,
                         ConsensusMistake,
                         testing::ValuesIn(mistakesOfThresholds()),
                         nameOf<testing::TestParamInfo<Mistake>>);
INSTANTIATE_TEST_SUITE_P(OfClouds,
                         ConsensusMistake,
                         testing::ValuesIn(mistakesOfClouds()),
                         nameOf<testing::TestParamInfo<Mistake>>);
INSTANTIATE_TEST_SUITE_P(OfRadii,
                         ConsensusMistake,
                         testing::ValuesIn(mistakesOfRadii()),
                         nameOf<testing::TestParamInfo<Mistake>>);

TEST(ConsensusNotices, AreNoneOfWhatIsRight)
{
  for (const int model : {int{pcl::SACMODEL_PLANE}, int{pcl::SACMODEL_SPHERE}})
    for (const auto& threshold : std::vector<std::function<void(Segmentation&)>>{
             [](auto&) {},
             [](auto& s) { s.setSigmaThreshold(2.0); },
             [](auto& s) { s.setDistanceThreshold(3.0 * kNoise); },
             [](auto& s) {
               s.setNoiseModel(nullptr);
               s.setDistanceThreshold(0.01);
             }}) {
      Use use;
      use.segmentation.setModelType(model);
      threshold(use.segmentation);
      pcl::PointIndices inliers;
      EXPECT_EQ(joined(use.notices(inliers)), "");
      EXPECT_GT(inliers.indices.size(), 300U);
      EXPECT_TRUE(isUsable(use.segmentation.getPatch().status));
    }
}

TEST(ConsensusNotices, SayWhatWasSearchedWhereThereIsNothing)
{
  Use use;
  use.segmentation.setRadiusLimits(0.5, 0.6); // neither the ball nor mistaken
  use.segmentation.setMaxIterations(5);
  use.segmentation.setIndices(pcl::make_shared<pcl::Indices>(pcl::Indices{0, 1, 2, 3}));
  pcl::PointIndices inliers;
  const std::vector<std::string> notices = use.notices(inliers);
  ASSERT_TRUE(inliers.indices.empty());
  ASSERT_EQ(notices.size(), 1U);
  EXPECT_TRUE(holdsAll(notices[0],
                       {"no patch",
                        "m apart",
                        "noise",
                        "threshold 3 sigmas",
                        "radius 0.5 m to 0.6 m",
                        "iterations"}))
      << notices[0];
}

// ---- Units

TEST(ConsensusThreshold, InMetresKeepsThePointsWithinSoManyMetres)
{
  for (const bool with_noise : {false, true})
    for (const double threshold : {0.005, 0.02}) {
      Use use;
      use.segmentation.setModelType(pcl::SACMODEL_PLANE);
      if (!with_noise)
        use.segmentation.setNoiseModel(nullptr);
      // As somebody does who has a pointer to PCL's class.
      pcl::SACSegmentation<pcl::PointXYZ>& base = use.segmentation;
      base.setDistanceThreshold(threshold);
      pcl::PointIndices inliers;
      pcl::ModelCoefficients coefficients;
      base.setInputCloud(use.cloud);
      base.segment(inliers, coefficients);
      ASSERT_EQ(coefficients.values.size(), 4U);
      const auto plane = Eigen::Vector4f::Map(coefficients.values.data());
      pcl::Indices expected;
      for (int i = 0; i < static_cast<int>(use.cloud->size()); ++i) {
        const Eigen::Vector4f q = (*use.cloud)[i].getVector3fMap().homogeneous();
        if (std::abs(plane.cast<double>().dot(q.cast<double>())) <= threshold)
          expected.push_back(i);
      }
      // But for points at the threshold: coefficients are float.
      EXPECT_NEAR(static_cast<double>(inliers.indices.size()),
                  static_cast<double>(expected.size()),
                  2.0);
      EXPECT_GT(inliers.indices.size(), 1000U);
      EXPECT_EQ(base.getDistanceThreshold(), threshold);
    }
}

TEST(ConsensusThreshold, IsTheOneSetLast)
{
  Segmentation segmentation;
  EXPECT_EQ(segmentation.getSigmaThreshold(), 3.0);
  segmentation.setDistanceThreshold(0.01);
  EXPECT_EQ(segmentation.getSigmaThreshold(), 0.0);
  EXPECT_EQ(segmentation.getDistanceThreshold(), 0.01);
  segmentation.setSigmaThreshold(2.0);
  EXPECT_EQ(segmentation.getSigmaThreshold(), 2.0);
  EXPECT_EQ(segmentation.getDistanceThreshold(), 0.0);
  static_cast<pcl::SACSegmentation<pcl::PointXYZ>&>(segmentation)
      .setDistanceThreshold(0.02);
  EXPECT_EQ(segmentation.getSigmaThreshold(), 0.0);
  EXPECT_EQ(segmentation.getDistanceThreshold(), 0.02);
  segmentation.setDistanceThreshold(0.0);
  EXPECT_EQ(segmentation.getSigmaThreshold(), 3.0);
}

TEST(ConsensusThreshold, SurvivesASearch)
{
  Use use;
  use.segmentation.setSigmaThreshold(2.5);
  pcl::PointIndices first, second;
  use.notices(first);
  EXPECT_EQ(use.segmentation.getSigmaThreshold(), 2.5);
  EXPECT_EQ(use.segmentation.getDistanceThreshold(), 0.0);
  use.notices(second);
  EXPECT_EQ(first.indices, second.indices);
}

// ---- The model under PCL's own RANSAC, which hands it a bare number

int
linesOf(const std::string& text, const std::string& word)
{
  std::istringstream stream(text);
  int count = 0;
  for (std::string line; std::getline(stream, line);)
    count += line.find(word) != std::string::npos ? 1 : 0;
  return count;
}

/// What is said while RANSAC searches with a threshold.
std::string
saidBy(const Model::Ptr& model, double threshold)
{
  testing::internal::CaptureStderr();
  pcl::RandomSampleConsensus<pcl::PointXYZ> ransac(model, threshold);
  ransac.setMaxIterations(30);
  ransac.computeModel();
  return testing::internal::GetCapturedStderr();
}

TEST(ConsensusModel, WarnsOnceOfAThresholdThatIsNotInItsUnit)
{
  const auto model = pcl::make_shared<Model>(SurfaceRequest::Plane, ballBeforeWall());
  model->setSensor(makeSensor(kCamera));
  EXPECT_EQ(model->getDistanceUnit(), ConsensusDistance::Mahalanobis);
  EXPECT_EQ(saidBy(model, 3.0), "");
  EXPECT_EQ(linesOf(saidBy(model, 0.01), "0.01 sigmas"), 1);
  EXPECT_EQ(saidBy(model, 0.01), "");
  ConsensusOptions options;
  options.distance = ConsensusDistance::Euclidean;
  model->setOptions(options);
  EXPECT_EQ(model->getDistanceUnit(), ConsensusDistance::Euclidean);
  EXPECT_EQ(saidBy(model, 0.01), "");
  EXPECT_EQ(linesOf(saidBy(model, 3.0), "3 m"), 1);
}

TEST(ConsensusModel, SaysThatItMeasuresInMetresForWantOfNoise)
{
  const auto model = pcl::make_shared<Model>(SurfaceRequest::Plane, ballBeforeWall());
  EXPECT_EQ(model->getDistanceUnit(), ConsensusDistance::Euclidean);
  EXPECT_EQ(saidBy(model, 0.01), "");
  EXPECT_EQ(linesOf(saidBy(model, 3.0), "read as metres"), 1);
}

TEST(ConsensusModel, WarnsOfRadiiAndKeepsStillAfterItWasAsked)
{
  const auto model = pcl::make_shared<Model>(SurfaceRequest::Sphere, ballBeforeWall());
  model->setSensor(makeSensor(kCamera));
  model->setRadiusLimits(0.05, 0.5);
  EXPECT_TRUE(model->getNotices(3.0).empty());
  EXPECT_EQ(model->getNotices(0.01).size(), 1U);
  EXPECT_EQ(saidBy(model, 0.01), "");
  model->setRadiusLimits(0.0, 0.001); // no sample makes a ball so small
  EXPECT_EQ(model->getNotices(3.0).size(), 1U);
  EXPECT_TRUE(holdsAll(model->explainNothing(3.0),
                       {"no patch", "0.001 m", "distance between points"}))
      << model->explainNothing(3.0);
}

}} // namespace holdfast
