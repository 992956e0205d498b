// Simulated errors that neighbouring pixels share: their covariance is the pattern's.
#include <holdfast/sensor/khoshelham_noise_model.h>
#include <holdfast/sensor/stereo_noise_model.h>
#include <holdfast/simulation/simulator.h>

#include "support/kinect_pattern.h"
#include "support/random.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <memory>

namespace holdfast { namespace {

using test::kinectPattern, test::Random;

// Seven Gaussian waves are within a hundredth of an exponential one.
double
allowanceFor(const NoisePattern& pattern)
{
  double variance = 0.0;
  for (const PatternWave& wave : pattern.waves)
    if (wave.shape == PatternShape::Exponential)
      variance += wave.sigma * wave.sigma;
  // And the lattice of nodes, within 2e-4 of each.
  return 0.01 * variance + 2e-4 * pattern.variance();
}

// Pixels at which products with those `shift` columns further are averaged.
struct Block {
  int column = 0;
  int row = 0;
  int width = 1;
  int height = 1;
};

using Field = std::vector<double>;
using Covariance = std::function<double(double distance_px)>;

double
meanProduct(const Field& field, int image_width, const Block& block, int shift)
{
  double sum = 0.0;
  for (int v = block.row; v < block.row + block.height; ++v)
    for (int u = block.column; u < block.column + block.width; ++u)
      sum += field[static_cast<std::size_t>(v * image_width + u)] *
             field[static_cast<std::size_t>(v * image_width + u + shift)];
  return sum / (block.width * block.height);
}

// Standard deviation of meanProduct() of a Gaussian field, by Isserlis' theorem: the
// covariance of the products at pixels d apart is C(d)^2 + C(d + D) C(d - D).
double
sigmaOfMeanProduct(const Covariance& C, const Block& block, double step, int shift)
{
  double sum = 0.0;
  for (int y = 1 - block.height; y < block.height; ++y)
    for (int x = 1 - block.width; x < block.width; ++x) {
      const auto at = [&](int dx) { return C(step * std::hypot(x + dx, y)); };
      sum += (block.width - std::abs(x)) * (block.height - std::abs(y)) *
             (at(0) * at(0) + at(shift) * at(-shift));
    }
  return std::sqrt(sum) / (block.width * block.height);
}

std::vector<double>
everyNth(int count, double step)
{
  std::vector<double> positions;
  for (int i = 0; i < count; ++i)
    positions.push_back(step * i);
  return positions;
}

struct FieldCase {
  NoisePattern pattern;
  int width;
  int height;
  double step; ///< between pixels of the image, px of the camera
  int draws;
  std::vector<int> shifts; ///< in pixels of the image
};

void
expectCovariance(const FieldCase& c, const Block& block, Random& random)
{
  const PatternField field(CorrelatedNoise(c.pattern),
                           everyNth(c.width, c.step),
                           everyNth(c.height, c.step));
  std::vector<double> mean(c.shifts.size(), 0.0);
  Field values;
  for (int draw = 0; draw < c.draws; ++draw) {
    field.draw(random.engine(), values);
    for (std::size_t i = 0; i < mean.size(); ++i)
      mean[i] += meanProduct(values, c.width, block, c.shifts[i]) / c.draws;
  }
  const auto C = [&](double distance) { return c.pattern.covariance(distance); };
  for (std::size_t i = 0; i < mean.size(); ++i) {
    const double sigma =
        sigmaOfMeanProduct(C, block, c.step, c.shifts[i]) / std::sqrt(c.draws);
    const double distance = c.step * c.shifts[i];
    EXPECT_NEAR(mean[i], C(distance), 4.5 * sigma + allowanceFor(c.pattern))
        << distance << " px, sigma " << sigma;
  }
}

TEST(PatternField, HasTheCovarianceOfThePattern)
{
  Random random;
  // Near neighbours, and far ones in an image with every eighth pixel.
  expectCovariance({kinectPattern(), 90, 60, 1.0, 300, {0, 1, 2, 3, 5, 10}},
                   {0, 0, 80, 60},
                   random);
  expectCovariance({kinectPattern(), 120, 90, 8.0, 400, {0, 1, 3, 7, 14, 25}},
                   {0, 0, 95, 90},
                   random);
  const NoisePattern exponential{{{0.089, 2.1, PatternShape::Exponential},
                                  {0.103, 79.0, PatternShape::Exponential}}};
  expectCovariance({exponential, 120, 90, 8.0, 200, {0, 1, 2, 5, 10, 25}},
                   {0, 0, 95, 90},
                   random);
}

// Where a wave is near the distance of the pixels, taps at the pixels alone would give
// neighbours a quarter of their covariance.
TEST(PatternField, HasItAtAnyLength)
{
  Random random;
  for (const double length : {0.26, 0.5, 0.8, 1.0, 1.7, 4.0}) {
    SCOPED_TRACE(length);
    expectCovariance(
        {{{{1.0, length, PatternShape::Gaussian}}}, 60, 60, 1.0, 300, {0, 1, 2, 4}},
        {0, 0, 56, 60},
        random);
  }
}

TEST(PatternField, HasItAtTheEdges)
{
  Random random;
  const FieldCase c{kinectPattern(), 40, 90, 4.0, 600, {0, 1, 6}};
  expectCovariance(c, {0, 0, 1, 90}, random); // the first column
  expectCovariance(c, {0, 0, 34, 1}, random); // the first row
  expectCovariance(c, {0, 89, 34, 1}, random); // the last
}

TEST(PatternField, IsReproducibleAndTakesOneGenerator)
{
  const PatternField field(CorrelatedNoise(kinectPattern()),
                           everyNth(30, 1.0),
                           everyNth(20, 1.0));
  std::mt19937_64 generator(3), same(3);
  Field first, again, next;
  field.draw(generator, first);
  field.draw(same, again);
  EXPECT_EQ(first, again);
  EXPECT_EQ(generator, same);
  field.draw(generator, next);
  EXPECT_NE(first, next);
}

TEST(PatternField, OfOnePixelOrNoneIsDrawnToo)
{
  std::mt19937_64 generator(3);
  Field field;
  PatternField(CorrelatedNoise(kinectPattern()), {7.0}, {9.0}).draw(generator, field);
  EXPECT_EQ(field.size(), 1U);
  PatternField(CorrelatedNoise(kinectPattern()), {}, {}).draw(generator, field);
  EXPECT_TRUE(field.empty());
}

TEST(PatternField, RefusesPixelsThatAreNoImage)
{
  const CorrelatedNoise noise(kinectPattern());
  EXPECT_THROW(PatternField(noise, {0.0, 0.0}, {0.0}), std::invalid_argument);
  EXPECT_THROW(PatternField(noise, {1.0, 0.0}, {0.0}), std::invalid_argument);
  EXPECT_THROW(PatternField(noise, {0.0}, {NAN}), std::invalid_argument);
}

// A camera of 64 x 48 pixels with the Kinect's noise: 0.17 px of disparity in all.
Sensor
kinect()
{
  Sensor sensor;
  sensor.name = "kinect";
  sensor.camera.width = 64;
  sensor.camera.height = 48;
  sensor.camera.cx = 31.5;
  sensor.camera.cy = 23.5;
  sensor.noise = std::make_shared<StereoNoiseModel>(StereoNoiseModel::Parameters{});
  sensor.pattern = kinectPattern();
  return sensor;
}

// A floor that fills the view, looked down at aslant.
Scene
floorScene()
{
  Scene scene;
  scene.name = "floor";
  scene.shapes = {std::make_shared<Terrain>(Eigen::Vector3d::Zero(), 6.0, 0.0, 1.0, 1)};
  scene.sensor_pose = lookAt({0.3, -0.4, 1.0}, {0, 0, 0}, {0, 0, 1});
  return scene;
}

// Errors of the points in px of disparity, and across the rays in px of the image.
struct Errors {
  Field disparity;
  Field lateral;
};

Errors
errorsOf(const RangeImage& image, const StereoNoiseModel::Parameters& p)
{
  Errors errors;
  for (std::size_t i = 0; i < image.points.size(); ++i) {
    const Eigen::Vector3d q = image.sensor_pose.toLocal(image.truth[i]);
    const Eigen::Vector3d e =
        image.sensor_pose.R.transpose() * (image.points[i] - image.truth[i]);
    errors.disparity.push_back(-e.z() / (q.z() * q.z()) * p.focal_px * p.baseline_m);
    errors.lateral.push_back((e.x() - e.z() * q.x() / q.z()) * p.focal_px / q.z());
  }
  return errors;
}

// Disparities: of one point 0.17^2, of two C(D), so that what is not the pattern's is
// the point's own. Across the ray nothing is shared.
TEST(SimulatedPattern, SharesThePatternAndNothingElse)
{
  Random random;
  const Sensor sensor = kinect();
  const StereoNoiseModel::Parameters p;
  constexpr double kScale = 0.7;
  constexpr int kDraws = 300;
  const int shifts[] = {0, 1, 2, 12};
  const Block block{0, 0, 52, 48};
  RangeImage image = castRays(floorScene(), pixelRays(sensor.camera));
  attachNoise(image, sensor, kScale);
  double disparity[4] = {}, lateral[4] = {};
  for (int draw = 0; draw < kDraws; ++draw) {
    drawNoise(image, random.engine(), image.points);
    const Errors errors = errorsOf(image, p);
    for (int i = 0; i < 4; ++i) {
      disparity[i] += meanProduct(errors.disparity, 64, block, shifts[i]) / kDraws;
      lateral[i] += meanProduct(errors.lateral, 64, block, shifts[i]) / kDraws;
    }
  }
  const double scale = kScale * kScale;
  const Covariance of_disparity = [&](double d) {
    return scale * (d == 0.0 ? p.sigma_disparity_px * p.sigma_disparity_px :
                               sensor.pattern.covariance(d));
  };
  const Covariance of_lateral = [&](double d) {
    return d == 0.0 ? scale * p.sigma_point_px * p.sigma_point_px : 0.0;
  };
  for (int i = 0; i < 4; ++i) {
    const auto bound = [&](const Covariance& C) {
      return 4.5 * sigmaOfMeanProduct(C, block, 1.0, shifts[i]) / std::sqrt(kDraws);
    };
    EXPECT_NEAR(disparity[i],
                of_disparity(shifts[i]),
                bound(of_disparity) + scale * allowanceFor(sensor.pattern));
    EXPECT_NEAR(lateral[i], of_lateral(shifts[i]), bound(of_lateral));
  }
}

TEST(SimulatedPattern, CovariancesStayThoseOfTheWholeNoise)
{
  const Sensor sensor = kinect();
  RangeImage with = castRays(floorScene(), pixelRays(sensor.camera, 4));
  RangeImage without = with;
  attachNoise(with, sensor, 0.5);
  attachNoise(without, *sensor.noise, 0.5);
  EXPECT_EQ(with.covariances, without.covariances);
  for (std::size_t i = 0; i < with.roots.size(); ++i) {
    const Eigen::Vector3d& r = with.pattern_directions[i];
    const Eigen::Matrix3d whole = with.roots[i] * with.roots[i].transpose() +
                                  sensor.pattern.variance() * r * r.transpose();
    EXPECT_LT((whole - with.covariances[i]).norm(), 1e-12 * whole.norm());
  }
}

// Off the optical axis this model's noise along the ray grows less than its pattern.
TEST(SimulatedPattern, CovariancesTellWhatWasDrawnWhereThereIsNoRoom)
{
  Sensor sensor;
  const KhoshelhamNoiseModel::Parameters p;
  sensor.noise = std::make_shared<KhoshelhamNoiseModel>(p);
  sensor.pattern.waves = {{p.sigma_z_per_m2, 20.0, PatternShape::Gaussian}};
  RangeImage image = castRays(floorScene(), pixelRays(sensor.camera, 40));
  attachNoise(image, sensor);
  for (std::size_t i = 0; i < image.roots.size(); ++i) {
    if (image.hits[i] < 0)
      continue;
    const Eigen::Vector3d& r = image.pattern_directions[i];
    const Eigen::Matrix3d whole = image.roots[i] * image.roots[i].transpose() +
                                  sensor.pattern.variance() * r * r.transpose();
    EXPECT_LT((whole - image.covariances[i]).norm(), 1e-8 * whole.norm());
  }
}

void
expectSameImage(const RangeImage& a, const RangeImage& b)
{
  ASSERT_EQ(a.points.size(), b.points.size());
  for (std::size_t i = 0; i < a.points.size(); ++i) {
    EXPECT_EQ(a.hits[i], b.hits[i]);
    if (a.hits[i] < 0)
      continue;
    EXPECT_EQ(a.points[i], b.points[i]);
    EXPECT_EQ(a.covariances[i], b.covariances[i]);
    EXPECT_EQ(a.roots[i], b.roots[i]);
  }
}

// To the last bit, and to the next number of the generator.
TEST(SimulatedPattern, WithoutWavesIsIndependentNoise)
{
  Sensor still = kinect();
  for (PatternWave& wave : still.pattern.waves)
    wave.sigma = 0.0;
  for (const std::string name : {"rocks", "sphere"})
    for (const Sensor& sensor : {withoutPattern(kinect()), still}) {
      const Scene scene = makeScene(name);
      const RayGrid rays = pixelRays(sensor.camera);
      std::mt19937_64 generator(11), same(11);
      const RangeImage image = simulate(scene, rays, sensor, {0.8, false}, generator);
      RangeImage alone = castRays(scene, rays, sensor.min_range_m, sensor.max_range_m);
      attachNoise(alone, *sensor.noise, 0.8);
      drawNoise(alone.truth, alone.roots, same, alone.points);
      expectSameImage(image, alone);
      EXPECT_EQ(generator, same);
    }
}

TEST(SimulatedPattern, IsReproducibleFromTheSeed)
{
  const Sensor sensor = kinect();
  const auto draw = [&](std::uint64_t seed) {
    std::mt19937_64 generator(seed);
    return simulate(makeScene("mix"),
                    pixelRays(sensor.camera, 2),
                    sensor,
                    {},
                    generator);
  };
  const RangeImage first = draw(7), other = draw(8);
  expectSameImage(first, draw(7));
  for (std::size_t i = 0; i < first.points.size(); ++i)
    EXPECT_EQ(first.points[i].allFinite(), other.points[i].allFinite());
}

TEST(SimulatedPattern, WithScaleZeroIsTheTruth)
{
  const Sensor sensor = kinect();
  std::mt19937_64 generator(7);
  const RangeImage image = simulate(makeScene("mix"),
                                    pixelRays(sensor.camera),
                                    sensor,
                                    {0.0, false},
                                    generator);
  for (std::size_t i = 0; i < image.points.size(); ++i)
    if (image.hits[i] >= 0) {
      EXPECT_EQ(image.points[i], image.truth[i]);
    }
}

// An image attached to a sensor without pattern after one with it.
TEST(SimulatedPattern, IsForgottenWithTheNoise)
{
  RangeImage image = castRays(floorScene(), pixelRays(kinect().camera, 8));
  attachNoise(image, kinect());
  EXPECT_NE(image.pattern, nullptr);
  attachNoise(image, withoutPattern(kinect()));
  EXPECT_EQ(image.pattern, nullptr);
  EXPECT_TRUE(image.pattern_directions.empty());
}

TEST(SimulatedPattern, NeedsRowsAndColumns)
{
  RayGrid rays = frustumRays(8, 0.5);
  RangeImage image = castRays(floorScene(), rays);
  EXPECT_NO_THROW(attachNoise(image, kinect()));
  rays.directions[20].x() += 1e-3;
  image = castRays(floorScene(), rays);
  EXPECT_THROW(attachNoise(image, kinect()), std::invalid_argument);
  EXPECT_NO_THROW(attachNoise(image, withoutPattern(kinect())));
}

}} // namespace holdfast
