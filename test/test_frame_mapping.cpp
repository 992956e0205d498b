// From frames of a moving camera to a map, against the simulated truth; and the map's
// file.
#include "support/chi_square_bounds.h"
#include "support/organized_cloud.h"
#include "support/run_program.h"
#include "support/spot.h"

#include <holdfast/geometry/rotation.h>
#include <holdfast/io/patch_map_file.h>
#include <holdfast/pcl/conversions.h>
#include <holdfast/pcl/frame_mapping.h>
#include <holdfast/pcl/map_conversions.h>
#include <holdfast/simulation/trajectory.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>

namespace holdfast { namespace {

using test::Random;

Sensor
smallKinect()
{
  return test::makeSensor(test::makeCamera(320, 240, 290.0));
}

RangeCloud
cloudOf(const RangeImage& world)
{
  const RangeImage image = inSensorFrame(world);
  auto points = pcl::make_shared<pcl::PointCloud<pcl::PointXYZ>>(
      static_cast<std::uint32_t>(image.width),
      static_cast<std::uint32_t>(image.height));
  points->is_dense = false;
  for (std::size_t i = 0; i < points->size(); ++i)
    (*points)[i].getVector3fMap() = image.points[i].cast<float>();
  return {points, {}, Pose()};
}

/// Some frames of a walk over rocks.
struct Walk {
  Scene scene;
  std::vector<Pose> poses;
  std::vector<RangeCloud> frames;

  Walk(int count,
       const Sensor& sensor,
       std::uint64_t seed,
       const std::string& name = "rocks")
  : scene(makeScene(name))
  {
    poses = circle(scene, count, 0.04);
    const FrameSimulator simulator(scene,
                                   pixelRays(sensor.camera),
                                   sensor,
                                   SimulationOptions(),
                                   PatternOverTime::Fixed,
                                   seed);
    for (int k = 0; k < count; ++k)
      frames.push_back(cloudOf(simulator.frame(k, poses[static_cast<std::size_t>(k)])));
  }
};

MappingOptions
mappingOptions()
{
  MappingOptions options;
  options.extraction.sampler.spacing_m = 0.08;
  return options;
}

/// NEES per degree of freedom of what the map says of heights and normals, about the
/// best quadric of the true surface, of patches with at least so many views.
double
heightAndNormalNees(const PatchMap& map,
                    const Scene& scene,
                    const Pose& true_pose,
                    int least_views,
                    int& counted)
{
  const Pose to_world = true_pose * map.pose().inverse();
  double sum = 0.0;
  counted = 0;
  for (const MapPatch& patch : map.patches()) {
    // Where the disc lies over an edge of a rock, no quadric is the surface. Third
    // derivatives of 100 /m^2 leave 0.4 mm.
    constexpr double kEdge = 2e-3;
    const auto truth = bestQuadric(scene, to_world * patch.anchor, patch.radius_m);
    if (!truth || patch.views < least_views || truth->residual_m > kEdge)
      continue;
    const Eigen::Vector3d e = (patch.jet.value() - truth->jet).head<3>();
    const Eigen::Matrix3d S = patch.jet.covariance().topLeftCorner<3, 3>();
    const double nees = e.dot(S.inverse() * e) / 3.0;
    sum += nees;
    ++counted;
  }
  return sum / counted;
}

struct Mapped {
  double nees = 0.0;
  int counted = 0, fused = 0, gated = 0;
};

Mapped
mapWithOdometry(const std::string& scene, int least_views, std::uint64_t walk_number)
{
  Random random(walk_number);
  const Sensor sensor = smallKinect();
  const Walk walk(10, sensor, random.seed(), scene);
  constexpr double kRad = 1e-3, kMetre = 1e-3;
  const Odometry odometry = noisyOdometry(walk.poses, kRad, kMetre, random.engine());
  JetVector variance;
  variance << Eigen::Vector3d::Constant(kRad * kRad),
      Eigen::Vector3d::Constant(kMetre * kMetre);
  FrameMapper mapper(sensor, mappingOptions());
  Mapped result;
  for (std::size_t k = 0; k < walk.frames.size(); ++k) {
    const FrameReport report =
        k == 0 ? mapper.addStill(walk.frames[k]) :
                 mapper.add(walk.frames[k],
                            {odometry.increments[k - 1], variance.asDiagonal()});
    const UpdateReport& u = report.update;
    EXPECT_EQ(report.measurements,
              u.fused + u.born + u.gated + u.replaced + u.surplus + u.uncertain +
                  u.unfit);
    result.fused += u.fused;
    result.gated += u.gated;
  }
  result.nees = heightAndNormalNees(mapper.map(),
                                    walk.scene,
                                    walk.poses.back(),
                                    least_views,
                                    result.counted);
  std::printf("  %s: NEES/dof %.3f of %d patches; %d fused, %d gated\n",
              scene.c_str(),
              result.nees,
              result.counted,
              result.fused,
              result.gated);
  return result;
}

/// Of several walks. Patches of one walk share the errors of its poses, so that its
/// NEES/dof scatters however many patches there are; the mean of this many by half of
/// that.
Mapped
meanOfWalks(const std::string& scene, int least_views)
{
  constexpr int kWalks = 4;
  Mapped mean;
  for (std::uint64_t walk = 0; walk < kWalks; ++walk) {
    const Mapped one = mapWithOdometry(scene, least_views, walk);
    mean.nees += one.nees / kWalks;
    mean.counted += one.counted;
    mean.fused += one.fused;
    mean.gated += one.gated;
  }
  return mean;
}

TEST(FrameMapper, MapsSmoothSurfacesWithOdometry)
{
  const Mapped ball = mapWithOdometry("ball", 2, 0);
  EXPECT_GT(ball.counted, 100);
  EXPECT_GT(ball.nees, 0.7);
  EXPECT_LT(ball.nees, 1.5);
  EXPECT_LT(ball.gated, 0.02 * ball.fused);
}

// Where patches are rougher than a quadric, what their third derivatives are takes
// several views to tell.
TEST(FrameMapper, MapsRocksWithOdometry)
{
  const Mapped rocks = meanOfWalks("rocks", 8);
  std::printf("  mean NEES/dof %.3f\n", rocks.nees);
  EXPECT_GT(rocks.counted, 200);
  EXPECT_GT(rocks.nees, 0.7);
  EXPECT_LT(rocks.nees, 1.5);
  EXPECT_LT(rocks.gated, 0.05 * rocks.fused);
}

TEST(FrameMapper, FindsItsPoses)
{
  Random random;
  const Sensor sensor = smallKinect();
  const Walk walk(6, sensor, random.seed());
  FrameMapper mapper(sensor, mappingOptions());
  double way = 0.0;
  for (std::size_t k = 0; k < walk.frames.size(); ++k) {
    const FrameReport report = mapper.addUnknown(walk.frames[k]);
    if (k == 0)
      continue;
    ASSERT_TRUE(report.registration);
    EXPECT_EQ(report.registration->status, RegistrationStatus::Converged);
    way += (walk.poses[k].c - walk.poses[k - 1].c).norm();
  }
  const Pose truth = walk.poses.front().inverse() * walk.poses.back();
  const double drift = (mapper.map().pose().c - truth.c).norm();
  std::printf("  drift %.2f mm over %.2f m\n", 1e3 * drift, way);
  EXPECT_LT(drift, 0.02 * way);
}

/// NEES of the pose of a second frame, by a mapper that nobody tells the motion of up
/// to several centimetres and some tens of milliradians.
double
neesOfRandomMotion(const Scene& scene, const Pose& first, Random& random)
{
  const Sensor sensor = test::makeSensor(test::makeCamera(240, 180, 217.0));
  const Pose motion{expMap(0.02 * random.normalVector()), 0.03 * random.normalVector()};
  const FrameSimulator simulator(scene,
                                 pixelRays(sensor.camera),
                                 sensor,
                                 SimulationOptions(),
                                 PatternOverTime::Fixed,
                                 random.seed());
  FrameMapper mapper(sensor);
  mapper.addUnknown(cloudOf(simulator.frame(0, first)));
  const FrameReport report =
      mapper.addUnknown(cloudOf(simulator.frame(1, first * motion)));
  const RegistrationResult& result = *report.registration;
  EXPECT_EQ(result.status, RegistrationStatus::Converged);
  EXPECT_EQ(result.null_space.cols(), 0);
  JetVector error;
  error << logMap(motion.R.transpose() * result.pose.R), result.pose.c - motion.c;
  return error.dot(result.covariance.inverse() * error);
}

// Patches a radius apart share most of their points, which are not to count twice.
TEST(FrameMapper, KnowsHowWellItFindsRandomMotions)
{
  constexpr int kTrials = 10;
  const Scene boulders = makeScene("boulder_field"), rocks = makeScene("rocks");
  const std::vector<Pose> along = walk(boulders, 80), around = circle(rocks, 40);
  const double largest = test::largestOf(2 * kTrials);
  double sum = 0.0;
  for (std::uint64_t trial = 0; trial < 2 * kTrials; ++trial) {
    Random random(trial);
    const bool walks = trial < kTrials;
    const std::vector<Pose>& poses = walks ? along : around;
    const Pose& first = poses[static_cast<std::size_t>(
        random.integer(0, static_cast<int>(poses.size()) - 1))];
    const double nees = neesOfRandomMotion(walks ? boulders : rocks, first, random);
    EXPECT_LT(nees, largest);
    sum += nees;
  }
  constexpr int kDegrees = 2 * kTrials * 6;
  const test::NeesBounds bounds(kDegrees);
  std::printf("  NEES/dof %.3f, in %.2f to %.2f\n",
              sum / kDegrees,
              bounds.lowest,
              bounds.highest);
  EXPECT_GT(sum / kDegrees, bounds.lowest);
  EXPECT_LT(sum / kDegrees, bounds.highest);
}

/// Patches born in each of the frames of a camera that stands still.
std::vector<int>
birthsStandingStill(const std::string& scene_name, int frames, int threads)
{
  const Sensor sensor = smallKinect();
  const Scene scene = makeScene(scene_name);
  const FrameSimulator simulator(scene,
                                 pixelRays(sensor.camera),
                                 sensor,
                                 SimulationOptions(),
                                 PatternOverTime::Fixed,
                                 Random().seed());
  MappingOptions options;
  options.extraction.threads = threads;
  FrameMapper mapper(sensor, options);
  std::vector<int> births;
  FrameReport report;
  for (int k = 0; k < frames; ++k) {
    report = mapper.addStill(cloudOf(simulator.frame(k, scene.sensor_pose)),
                             std::move(report));
    births.push_back(report.update.born);
  }
  return births;
}

// Seeds find room between anchors for as long as noise moves these; what was seen there
// leaves none.
TEST(FrameMapper, BearsNextToNothingWhereAllWasSeen)
{
  constexpr double kFew =
      0.03; // of the first frame's: what came out for the first time
  for (const char* scene : {"rocks", "mix"}) {
    const std::vector<int> births = birthsStandingStill(scene, 20, 1);
    std::printf("  %s:", scene);
    for (const int born : births)
      std::printf(" %d", born);
    std::printf("\n");
    for (std::size_t k = 3; k < births.size(); ++k)
      EXPECT_LE(births[k], kFew * births[0]) << scene << ", frame " << k;
    const std::vector<int> others = birthsStandingStill(scene, 5, 2);
    EXPECT_TRUE(std::equal(others.begin(), others.end(), births.begin())) << scene;
  }
}

TEST(FrameMapper, DoesNotDependOnThreads)
{
  Random random;
  const Sensor sensor = smallKinect();
  const Walk walk(3, sensor, random.seed());
  MappingOptions options = mappingOptions();
  std::vector<std::string> maps;
  for (const int threads : {1, 2}) {
    options.extraction.threads = threads;
    FrameMapper mapper(sensor, options);
    for (const RangeCloud& frame : walk.frames)
      mapper.addUnknown(frame);
    std::ostringstream text;
    writePatchMap(text, {mapper.map(), sensor.name});
    maps.push_back(text.str());
  }
  EXPECT_TRUE(maps[0] == maps[1]);
}

TEST(FrameMapper, RefusesWhatIsNoFrame)
{
  FrameMapper mapper(smallKinect(), mappingOptions());
  RangeCloud line;
  line.points = pcl::make_shared<pcl::PointCloud<pcl::PointXYZ>>(10, 1);
  EXPECT_THROW(mapper.addStill(line), std::invalid_argument);
  EXPECT_THROW(mapper.add(line, Motion()), std::invalid_argument);
  // A frame without a point is one that sees nothing.
  const RangeCloud empty = test::makeOrganizedCloud(smallKinect().camera, [](int, int) {
    return std::nan("");
  });
  const FrameReport report = mapper.addStill(empty);
  EXPECT_EQ(report.measurements, 0);
  EXPECT_TRUE(mapper.map().patches().empty());
}

TEST(MapConversions, TakePatchPoints)
{
  Random random;
  const Sensor sensor = smallKinect();
  const Walk walk(2, sensor, random.seed());
  ExtractionOptions options;
  options.fit.surface = SurfaceRequest::Paraboloid;
  PatchMap map;
  for (int k = 0; k < 2; ++k) {
    const ExtractionResult result =
        extractPatches(walk.frames[static_cast<std::size_t>(k)], sensor, options);
    const auto points = toPatchCloud(result.patches, Pose());
    int left_out = -1;
    const UpdateReport report =
        updateMap(map,
                  points,
                  walk.poses[0].inverse() * walk.poses[static_cast<std::size_t>(k)],
                  1e-6 * JetMatrix::Identity(),
                  &left_out);
    EXPECT_EQ(left_out, 0);
    EXPECT_EQ(report.fused > 0, k == 1);
  }
  const pcl::PointCloud<PatchPoint> back = toPatchCloud(map);
  EXPECT_EQ(back.size(), map.patches().size());
  pcl::PointCloud<PatchPoint> strange = back;
  strange[0].surface = 200;
  strange[1].getVector3fMap().setConstant(std::nanf(""));
  strange[1].state[0] = std::nanf("");
  int left_out = 0;
  const auto measurements = toMeasurements(strange, &left_out);
  EXPECT_EQ(measurements.size() + static_cast<std::size_t>(left_out), strange.size());
  EXPECT_GE(left_out, 1);
}

class MapFile : public testing::Test {
protected:
  MapFile() : path_(test::freshFolder("map_file") + "/walk.map")
  {
    const Sensor sensor = smallKinect();
    const Walk walk(1, sensor, 1);
    FrameMapper mapper(sensor, mappingOptions());
    mapper.addStill(walk.frames[0]);
    savePatchMap(path_, {mapper.map(), sensor.name});
    std::ifstream file(path_, std::ios::binary);
    bytes_.assign(std::istreambuf_iterator<char>(file), {});
  }

  /// What is said about other bytes in that file.
  std::string complaint(const std::string& bytes) const
  {
    std::ofstream(path_, std::ios::binary) << bytes;
    try {
      loadPatchMap(path_);
    }
    catch (const std::runtime_error& error) {
      return error.what();
    }
    return "";
  }

  std::string path_, bytes_;
};

TEST_F(MapFile, KeepsEveryBit)
{
  const StoredMap stored = loadPatchMap(path_);
  EXPECT_EQ(stored.sensor, "test");
  EXPECT_FALSE(stored.map.patches().empty());
  std::ostringstream again;
  writePatchMap(again, stored);
  EXPECT_TRUE(again.str() == bytes_);
}

TEST_F(MapFile, SaysWhatIsWrong)
{
  const auto contains = [](const std::string& text, const std::string& part) {
    return text.find(part) != std::string::npos && text.find('\n') == std::string::npos;
  };
  for (const std::size_t length :
       {std::size_t{20}, bytes_.size() / 2, bytes_.size() - 1})
    EXPECT_TRUE(contains(complaint(bytes_.substr(0, length)), "is cut short"))
        << length;
  EXPECT_TRUE(contains(complaint(bytes_ + "x"), "damaged"));
  std::string damaged = bytes_;
  damaged[damaged.size() / 3] ^= 4;
  EXPECT_TRUE(contains(complaint(damaged), "damaged"));
  std::string later = bytes_;
  later[19] = 7;
  EXPECT_TRUE(contains(complaint(later), "version 7"));
  EXPECT_TRUE(contains(complaint("version https://git-lfs.github.com/spec/v1\noid x\n"),
                       "not a map of patches"));
  EXPECT_TRUE(contains(complaint("# .PCD v0.7\n"), "not a map of patches"));
  EXPECT_NE(complaint(""), "");
  std::filesystem::remove(path_);
  try {
    loadPatchMap(path_);
    FAIL();
  }
  catch (const std::runtime_error& error) {
    EXPECT_TRUE(contains(error.what(), path_));
  }
}

}} // namespace holdfast
