#include "support/organized_cloud.h"
#include "support/random.h"

#include <holdfast/pcl/neighborhood_sampler.h>

#include <pcl/common/point_tests.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <set>
#include <stdexcept>

namespace holdfast { namespace {

using test::kNaN;
using test::makeCamera;
using test::makeOrganizedCloud;
using test::makeSensor;
using test::Random;

using Indices = std::vector<int>;

const Camera kCamera = makeCamera(80, 60, 100.0);

Pose
randomPose(Random& random)
{
  return {random.rotation(), random.uniformVector(-1.0, 1.0)};
}

/// Rolling ground with noise, steps and 10 % holes.
RangeCloud
makeRoughCloud(Random& random)
{
  return makeOrganizedCloud(
      kCamera,
      [&random](int u, int v) {
        if (random.uniform(0.0, 1.0) < 0.1)
          return std::nan("");
        const double step = u > 50 ? 0.1 : 0.0;
        return 1.0 + step + 0.05 * std::sin(0.2 * u) * std::cos(0.15 * v) +
               0.004 * random.normal();
      },
      randomPose(random));
}

RangeCloud
makeScatteredCloud(Random& random, int n)
{
  auto points = pcl::make_shared<pcl::PointCloud<pcl::PointXYZ>>();
  for (int i = 0; i < n; ++i) {
    pcl::PointXYZ p;
    p.getVector3fMap() = random.uniformVector(-1.0, 1.0).cast<float>();
    if (random.uniform(0.0, 1.0) < 0.05)
      p.x = kNaN;
    points->push_back(p);
  }
  points->is_dense = false;
  return {points, {}, {}};
}

Indices
neighborhoodOf(const RangeCloud& cloud, const SamplerOptions& options, int seed)
{
  const NeighborhoodSampler sampler(cloud, makeSensor(kCamera), options);
  const auto scratch = sampler.makeScratch();
  Indices indices{-1}; // what was there before must go
  sampler.neighborhood(seed, *scratch, indices);
  return indices;
}

SamplerOptions
makeOptions(Neighborhood neighborhood, double radius)
{
  SamplerOptions options;
  options.neighborhood = neighborhood;
  options.radius_m = radius;
  return options;
}

double
distance(const RangeCloud& cloud, int a, int b)
{
  return ((*cloud.points)[a].getVector3fMap() - (*cloud.points)[b].getVector3fMap())
      .cast<double>()
      .norm();
}

bool
isFinite(const RangeCloud& cloud, int i)
{
  return pcl::isFinite((*cloud.points)[i]);
}

Indices
finitePoints(const RangeCloud& cloud)
{
  Indices finite;
  for (int i = 0; i < static_cast<int>(cloud.points->size()); ++i)
    if (isFinite(cloud, i))
      finite.push_back(i);
  return finite;
}

int
anyFinitePoint(const RangeCloud& cloud, Random& random)
{
  const Indices finite = finitePoints(cloud);
  return finite[random.integer(0, static_cast<int>(finite.size()) - 1)];
}

void
expectIsBall(const RangeCloud& cloud, int seed, double radius, const Indices& indices)
{
  EXPECT_TRUE(std::is_sorted(indices.begin(), indices.end()));
  const std::set<int> found(indices.begin(), indices.end());
  EXPECT_EQ(found.size(), indices.size());
  EXPECT_EQ(found.count(seed), 1U);
  // Points this close to the sphere may fall on either side in single precision.
  const double band = 1e-6;
  for (const int i : finitePoints(cloud)) {
    const double d = distance(cloud, seed, i);
    if (d < radius - band) {
      EXPECT_EQ(found.count(i), 1U) << "missing point " << i << " at " << d;
    }
    else if (d > radius + band) {
      EXPECT_EQ(found.count(i), 0U) << "point " << i << " at " << d;
    }
  }
}

TEST(Ball, IsTheBruteForceBallInOrganizedClouds)
{
  for (std::uint64_t c = 0; c < 10; ++c) {
    Random random(c);
    const RangeCloud cloud = makeRoughCloud(random);
    const double radius = random.uniform(0.01, 0.3);
    const int seed = anyFinitePoint(cloud, random);
    expectIsBall(cloud,
                 seed,
                 radius,
                 neighborhoodOf(cloud, makeOptions(Neighborhood::Ball, radius), seed));
  }
}

TEST(Ball, IsTheBruteForceBallInScatteredClouds)
{
  for (std::uint64_t c = 0; c < 10; ++c) {
    Random random(c);
    const RangeCloud cloud = makeScatteredCloud(random, 2000);
    const double radius = random.uniform(0.05, 0.5);
    const int seed = anyFinitePoint(cloud, random);
    expectIsBall(cloud,
                 seed,
                 radius,
                 neighborhoodOf(cloud, makeOptions(Neighborhood::Ball, radius), seed));
  }
}

TEST(Ball, LargerThanTheSceneIsTheScene)
{
  Random random;
  const RangeCloud cloud = makeRoughCloud(random);
  const int seed = anyFinitePoint(cloud, random);
  EXPECT_EQ(neighborhoodOf(cloud, makeOptions(Neighborhood::Ball, 100.0), seed),
            finitePoints(cloud));
}

// A grid of points that is no image: rows and columns in any order.
TEST(Ball, DoesNotTrustAGridThatIsNoImage)
{
  Random random;
  RangeCloud cloud = makeScatteredCloud(random, 1200);
  auto points = pcl::make_shared<pcl::PointCloud<pcl::PointXYZ>>(*cloud.points);
  points->width = 40;
  points->height = 30;
  cloud.points = points;
  const int seed = anyFinitePoint(cloud, random);
  for (const Neighborhood kind : {Neighborhood::Ball, Neighborhood::Disc})
    expectIsBall(cloud, seed, 0.3, neighborhoodOf(cloud, makeOptions(kind, 0.3), seed));
}

TEST(Disc, OnAWallIsTheImageOfTheRadius)
{
  const double depth = 0.8;
  const double radius = 0.05;
  const RangeCloud cloud =
      makeOrganizedCloud(kCamera, [depth](int, int) { return depth; });
  const double radius_px = radius / depth * kCamera.fx;
  const int u0 = 30;
  const int v0 = 20;
  Indices expected;
  for (int v = 0; v < kCamera.height; ++v)
    for (int u = 0; u < kCamera.width; ++u)
      if (std::hypot(u - u0, v - v0) <= radius_px)
        expected.push_back(v * kCamera.width + u);
  const Indices disc = neighborhoodOf(cloud,
                                      makeOptions(Neighborhood::Disc, radius),
                                      v0 * kCamera.width + u0);
  EXPECT_EQ(disc, expected);
}

TEST(Disc, IsAnEllipseWherePixelsAreNotSquare)
{
  Camera camera = kCamera;
  camera.fy = 2.0 * camera.fx;
  const RangeCloud cloud = makeOrganizedCloud(camera, [](int, int) { return 1.0; });
  const Indices disc = neighborhoodOf(cloud,
                                      makeOptions(Neighborhood::Disc, 0.085),
                                      30 * camera.width + 40);
  const auto rowOf = [&](int i) { return i / camera.width; };
  const auto columnOf = [&](int i) { return i % camera.width; };
  EXPECT_EQ(rowOf(disc.front()), 30 - 17);
  EXPECT_EQ(rowOf(disc.back()), 30 + 17);
  const auto [left, right] =
      std::minmax_element(disc.begin(), disc.end(), [&](int a, int b) {
        return columnOf(a) < columnOf(b);
      });
  EXPECT_EQ(columnOf(*left), 40 - 8);
  EXPECT_EQ(columnOf(*right), 40 + 8);
}

TEST(Disc, EndsAtAStep)
{
  const auto depthAt = [](int u, int) { return u < 40 ? 1.0 : 1.2; };
  const RangeCloud cloud = makeOrganizedCloud(kCamera, depthAt);
  const SamplerOptions options = makeOptions(Neighborhood::Disc, 0.1);
  for (const int u : {37, 39, 40, 42}) {
    const Indices disc = neighborhoodOf(cloud, options, 30 * kCamera.width + u);
    EXPECT_GT(disc.size(), 50U);
    for (const int i : disc)
      EXPECT_EQ(i % kCamera.width < 40, u < 40) << "seed column " << u;
  }
}

// Beyond a trench lies ground of the same depth: near, but not the same surface.
TEST(Disc, DoesNotCrossATrench)
{
  const auto depthAt = [](int u, int) { return u == 40 ? 1.3 : 1.0; };
  const RangeCloud cloud = makeOrganizedCloud(kCamera, depthAt);
  const Indices disc = neighborhoodOf(cloud,
                                      makeOptions(Neighborhood::Disc, 0.1),
                                      30 * kCamera.width + 37);
  for (const int i : disc)
    EXPECT_LT(i % kCamera.width, 40);
}

TEST(Disc, GoesAroundAHole)
{
  const auto depthAt = [](int u, int v) {
    return u == 40 && v > 22 ? std::nan("") : 1.0;
  };
  const RangeCloud cloud = makeOrganizedCloud(kCamera, depthAt);
  const Indices disc = neighborhoodOf(cloud,
                                      makeOptions(Neighborhood::Disc, 0.1),
                                      30 * kCamera.width + 38);
  EXPECT_TRUE(std::binary_search(disc.begin(), disc.end(), 30 * kCamera.width + 42));
  EXPECT_FALSE(std::binary_search(disc.begin(), disc.end(), 30 * kCamera.width + 40));
}

/// The definition of the disc, pixel by pixel.
Indices
floodFill(const RangeCloud& cloud, const SamplerOptions& options, int seed)
{
  const Sensor sensor = makeSensor(kCamera);
  const auto inCamera = [&](int i) {
    return cloud.sensor_pose.toLocal(
        (*cloud.points)[i].getVector3fMap().cast<double>());
  };
  const Eigen::Vector3d q = inCamera(seed);
  const double sigma = std::sqrt(sensor.noise->covariance(q)(2, 2));
  const double jump =
      std::max(options.jump_sigmas * sigma, options.max_slope * q.z() / kCamera.fx);
  const double radius_px = options.radius_m / q.z() * kCamera.fx;
  const int u0 = seed % kCamera.width;
  const int v0 = seed / kCamera.width;
  std::set<int> reached{seed};
  std::deque<int> open{seed};
  while (!open.empty()) {
    const int i = open.front();
    open.pop_front();
    const int u = i % kCamera.width;
    const int v = i / kCamera.width;
    for (const auto& [a, b] :
         {std::pair{u - 1, v}, {u + 1, v}, {u, v - 1}, {u, v + 1}}) {
      if (a < 0 || b < 0 || a >= kCamera.width || b >= kCamera.height)
        continue;
      const int j = b * kCamera.width + a;
      if (std::hypot(a - u0, b - v0) <= radius_px && isFinite(cloud, j) &&
          std::abs(inCamera(i).z() - inCamera(j).z()) < jump &&
          reached.insert(j).second)
        open.push_back(j);
    }
  }
  return {reached.begin(), reached.end()};
}

TEST(Disc, IsTheFloodFillOfItsDefinition)
{
  for (std::uint64_t c = 0; c < 50; ++c) {
    Random random(c);
    const RangeCloud cloud = makeRoughCloud(random);
    SamplerOptions options = makeOptions(Neighborhood::Disc, random.uniform(0.02, 0.4));
    // Cuts at many noisy pixels, so that the shapes are ragged.
    options.jump_sigmas = 1.0;
    options.max_slope = random.uniform(0.2, 1.0);
    const int seed = anyFinitePoint(cloud, random);
    EXPECT_EQ(neighborhoodOf(cloud, options, seed), floodFill(cloud, options, seed));
  }
}

// ---- Patch ----

/// A plane through (0, 0, 1), tilted about a random axis in the image.
struct TiltedPlane {
  Eigen::Vector3d normal;
  Camera camera;

  TiltedPlane(double tilt, const Camera& seen_by, Random& random) : camera(seen_by)
  {
    const double azimuth = random.uniform(0.0, 6.28);
    normal << std::sin(tilt) * std::cos(azimuth), std::sin(tilt) * std::sin(azimuth),
        -std::cos(tilt);
  }

  /// Nothing where the ray misses it.
  double depthAt(int u, int v) const
  {
    const Eigen::Vector3d ray((u - camera.cx) / camera.fx,
                              (v - camera.cy) / camera.fy,
                              1.0);
    const double z = normal.z() / normal.dot(ray);
    return z > 0.2 && z < 5.0 ? z : std::nan("");
  }
};

RangeCloud
unorganized(const RangeCloud& cloud)
{
  RangeCloud list = cloud;
  auto points = pcl::make_shared<pcl::PointCloud<pcl::PointXYZ>>(*cloud.points);
  points->width *= points->height;
  points->height = 1;
  list.points = points;
  return list;
}

// On a plane the ball of the exact points is the disc along it.
TEST(Patch, OnAPlaneIsItsDiscAtEveryTilt)
{
  for (std::uint64_t c = 0; c < 40; ++c) {
    Random random(c);
    const TiltedPlane plane(random.uniform(0.0, 1.3), kCamera, random);
    const RangeCloud cloud = makeOrganizedCloud(
        kCamera,
        [&](int u, int v) { return plane.depthAt(u, v); },
        randomPose(random));
    const int seed = 30 * kCamera.width + 40;
    const double radius = random.uniform(0.05, 0.15);
    for (const RangeCloud& seen : {cloud, unorganized(cloud)}) {
      const Indices inner =
          neighborhoodOf(seen,
                         makeOptions(Neighborhood::Ball, radius * (1.0 - 1e-4)),
                         seed);
      const Indices outer =
          neighborhoodOf(seen,
                         makeOptions(Neighborhood::Ball, radius * (1.0 + 1e-4)),
                         seed);
      const Indices patch =
          neighborhoodOf(seen, makeOptions(Neighborhood::Patch, radius), seed);
      EXPECT_TRUE(
          std::includes(patch.begin(), patch.end(), inner.begin(), inner.end()));
      EXPECT_TRUE(
          std::includes(outer.begin(), outer.end(), patch.begin(), patch.end()));
    }
  }
}

// Which points belong is decided by their rays: of noisy points very nearly the same as
// of exact ones, and the same share of either tail.
TEST(Patch, DoesNotCutTheTailsOfTheNoise)
{
  const Camera camera = makeCamera(160, 120, 200.0);
  double spread = 0.0;
  int points = 0;
  for (std::uint64_t c = 0; c < 40; ++c) {
    Random random(c);
    const TiltedPlane plane(random.uniform(0.0, 1.1), camera, random);
    constexpr double kSigma = 0.006; // of depth, twice a pixel
    std::vector<double> error;
    const RangeCloud cloud = makeOrganizedCloud(camera, [&](int u, int v) {
      error.push_back(random.normal());
      return plane.depthAt(u, v) + kSigma * error.back();
    });
    const int seed = 60 * camera.width + 80;
    Sensor sensor = makeSensor(camera);
    const NeighborhoodSampler sampler(cloud,
                                      sensor,
                                      makeOptions(Neighborhood::Patch, 0.08));
    const auto scratch = sampler.makeScratch();
    Indices indices;
    sampler.neighborhood(seed, *scratch, indices);
    EXPECT_GT(indices.size(), 50U);
    for (const int i : indices) {
      spread += error[static_cast<std::size_t>(i)] * error[static_cast<std::size_t>(i)];
      ++points;
    }
  }
  // A ball cuts it to 0.7 here. Four standard deviations of the mean of squares.
  EXPECT_NEAR(spread / points, 1.0, 4.0 * std::sqrt(2.0 / points));
}

TEST(Patch, EndsAtAStepAndAtAGrazingOne)
{
  for (const double slope : {0.0, 2.0}) {
    const auto depthAt = [slope](int u, int v) {
      const double z = 1.0 / (1.0 + slope * (v - 30) / kCamera.fy);
      return u < 40 ? z : z + 0.1;
    };
    const RangeCloud cloud = makeOrganizedCloud(kCamera, depthAt);
    const SamplerOptions options = makeOptions(Neighborhood::Patch, 0.1);
    for (const int u : {36, 38, 41, 43}) {
      const Indices patch = neighborhoodOf(cloud, options, 30 * kCamera.width + u);
      EXPECT_GT(patch.size(), 50U);
      for (const int i : patch)
        EXPECT_EQ(i % kCamera.width < 40, u < 40) << "seed column " << u;
    }
  }
}

TEST(Patch, GoesAroundAHoleButNotAcrossATrench)
{
  const auto depthAt = [](int u, int v) {
    return u == 40 ? (v > 22 ? std::nan("") : 1.0) : u == 30 ? 1.3 : 1.0;
  };
  const RangeCloud cloud = makeOrganizedCloud(kCamera, depthAt);
  const Indices patch = neighborhoodOf(cloud,
                                       makeOptions(Neighborhood::Patch, 0.1),
                                       30 * kCamera.width + 38);
  EXPECT_TRUE(std::binary_search(patch.begin(), patch.end(), 30 * kCamera.width + 42));
  for (const int i : patch)
    EXPECT_GT(i % kCamera.width, 30);
}

// Two walls that meet in an edge: what lies behind it is none of the seed's surface,
// once asked strictly.
TEST(Patch, StrictlyEndsAtAnEdge)
{
  const auto depthAt = [](int u, int) {
    return 1.0 / (1.0 + (u < 40 ? 0.0 : 1.2 * (u - 40) / kCamera.fx));
  };
  const RangeCloud cloud = makeOrganizedCloud(kCamera, depthAt);
  const NeighborhoodSampler sampler(cloud,
                                    makeSensor(kCamera),
                                    makeOptions(Neighborhood::Patch, 0.1));
  const auto scratch = sampler.makeScratch();
  Indices strict;
  sampler.strictNeighborhood(30 * kCamera.width + 33, *scratch, strict);
  EXPECT_GT(strict.size(), 100U);
  for (const int i : strict)
    EXPECT_LE(i % kCamera.width, 42); // two pixels are within five sigmas
}

TEST(Geodesic, IsWithinTheBallAndNearlyAllOfItOnAWall)
{
  const RangeCloud cloud = makeOrganizedCloud(kCamera, [](int, int) { return 1.0; });
  const int seed = 30 * kCamera.width + 40;
  const Indices ball =
      neighborhoodOf(cloud, makeOptions(Neighborhood::Ball, 0.099), seed);
  const Indices reached =
      neighborhoodOf(cloud, makeOptions(Neighborhood::Geodesic, 0.099), seed);
  EXPECT_TRUE(std::includes(ball.begin(), ball.end(), reached.begin(), reached.end()));
  // Paths in eight directions are at most 8.2 % too long: an octagon in the circle.
  EXPECT_GT(reached.size(), 0.85 * ball.size());
}

TEST(Geodesic, DoesNotCrossATrench)
{
  const auto depthAt = [](int u, int) { return u == 40 ? 1.3 : 1.0; };
  const RangeCloud cloud = makeOrganizedCloud(kCamera, depthAt);
  const Indices reached = neighborhoodOf(cloud,
                                         makeOptions(Neighborhood::Geodesic, 0.1),
                                         30 * kCamera.width + 37);
  EXPECT_GT(reached.size(), 50U);
  for (const int i : reached)
    EXPECT_LT(i % kCamera.width, 40);
}

// A ring of points with a narrow gap: near across the gap, far along the ring.
TEST(Geodesic, FollowsScatteredPointsRatherThanJumping)
{
  auto points = pcl::make_shared<pcl::PointCloud<pcl::PointXYZ>>();
  constexpr int kPoints = 300;
  for (int i = 0; i < kPoints; ++i) {
    const double angle = 0.1 + (2.0 * 3.14159265 - 0.2) * i / (kPoints - 1);
    points->push_back({static_cast<float>(std::cos(angle)),
                       static_cast<float>(std::sin(angle)),
                       1.0F});
  }
  const RangeCloud cloud{points, {}, {}};
  const Indices reached =
      neighborhoodOf(cloud, makeOptions(Neighborhood::Geodesic, 0.5), 0);
  // Half a metre of arc from one end of the ring.
  ASSERT_GT(reached.size(), 20U);
  EXPECT_LT(reached.back(), kPoints / 2);
  for (std::size_t i = 0; i < reached.size(); ++i)
    EXPECT_EQ(reached[i], static_cast<int>(i));
}

TEST(Knn, AreTheNearestByBruteForce)
{
  for (std::uint64_t c = 0; c < 5; ++c) {
    Random random(c);
    const RangeCloud cloud =
        c % 2 == 0 ? makeScatteredCloud(random, 1000) : makeRoughCloud(random);
    SamplerOptions options = makeOptions(Neighborhood::Knn, 0.05);
    options.k = 50;
    const int seed = anyFinitePoint(cloud, random);
    const Indices found = neighborhoodOf(cloud, options, seed);
    Indices expected = finitePoints(cloud);
    std::sort(expected.begin(), expected.end(), [&](int a, int b) {
      return distance(cloud, seed, a) < distance(cloud, seed, b);
    });
    expected.resize(50);
    std::sort(expected.begin(), expected.end());
    EXPECT_EQ(found, expected);
  }
}

TEST(Knn, HoldsTheSeedAmongEqualPoints)
{
  auto points = pcl::make_shared<pcl::PointCloud<pcl::PointXYZ>>();
  for (int i = 0; i < 200; ++i)
    points->push_back({0.0F, 0.0F, 1.0F});
  SamplerOptions options = makeOptions(Neighborhood::Knn, 0.05);
  options.k = 10;
  for (const int seed : {0, 77, 199}) {
    const Indices found = neighborhoodOf({points, {}, {}}, options, seed);
    EXPECT_EQ(found.size(), 10U);
    EXPECT_TRUE(std::binary_search(found.begin(), found.end(), seed));
  }
}

TEST(Knn, OfATooSmallCloudIsTheCloud)
{
  Random random;
  const RangeCloud cloud = makeScatteredCloud(random, 20);
  SamplerOptions options = makeOptions(Neighborhood::Knn, 0.05);
  EXPECT_EQ(neighborhoodOf(cloud, options, finitePoints(cloud).front()),
            finitePoints(cloud));
}

// ---- Seeds ----

Indices
seedsOf(const RangeCloud& cloud, const SamplerOptions& options)
{
  return NeighborhoodSampler(cloud, makeSensor(kCamera), options).seeds();
}

SamplerOptions
makeSeedOptions(SeedStrategy strategy, double spacing, int max_seeds = 0)
{
  SamplerOptions options;
  options.strategy = strategy;
  options.spacing_m = spacing;
  options.max_seeds = max_seeds;
  return options;
}

constexpr std::array<SeedStrategy, 3> kStrategies{SeedStrategy::Grid,
                                                  SeedStrategy::Random,
                                                  SeedStrategy::Poisson};

TEST(Seeds, AreValidAndDifferentAndReproducible)
{
  Random random;
  const RangeCloud organized = makeRoughCloud(random);
  const RangeCloud scattered = makeScatteredCloud(random, 3000);
  for (const RangeCloud& cloud : {organized, scattered})
    for (const SeedStrategy strategy : kStrategies) {
      SamplerOptions options = makeSeedOptions(strategy, 0.1);
      const Indices seeds = seedsOf(cloud, options);
      EXPECT_GT(seeds.size(), 20U);
      EXPECT_EQ(std::set<int>(seeds.begin(), seeds.end()).size(), seeds.size());
      for (const int seed : seeds)
        EXPECT_TRUE(isFinite(cloud, seed));
      EXPECT_EQ(seeds, seedsOf(cloud, options));
      options.random_seed = 2;
      EXPECT_EQ(seeds == seedsOf(cloud, options), strategy == SeedStrategy::Grid);
    }
}

TEST(Seeds, NeverExceedTheLimitAndStillSpanTheCloud)
{
  Random random;
  const RangeCloud organized = makeRoughCloud(random);
  const RangeCloud scattered = makeScatteredCloud(random, 3000);
  for (const RangeCloud& cloud : {organized, scattered})
    for (const SeedStrategy strategy : kStrategies) {
      const Indices seeds = seedsOf(cloud, makeSeedOptions(strategy, 0.02, 40));
      EXPECT_LE(seeds.size(), 40U);
      EXPECT_GE(seeds.size(), 10U);
      const int last = static_cast<int>(cloud.points->size()) - 1;
      EXPECT_LT(*std::min_element(seeds.begin(), seeds.end()), 0.25 * last);
      EXPECT_GT(*std::max_element(seeds.begin(), seeds.end()), 0.75 * last);
    }
}

// A floor from 1 to 5 m: seeds are as dense on it far away as near by.
TEST(Seeds, OfAGridAreOneSpacingApartNearAndFar)
{
  const Camera camera = makeCamera(160, 120, 200.0);
  const RangeCloud cloud = makeOrganizedCloud(camera, [&](int, int v) {
    return 1.0 / (0.2 + 0.8 * v / camera.height);
  });
  constexpr double kSpacing = 0.1;
  SamplerOptions options = makeSeedOptions(SeedStrategy::Grid, kSpacing);
  const NeighborhoodSampler sampler(cloud, makeSensor(camera), options);
  const Indices seeds = sampler.seeds();
  std::vector<double> nearest_seed(cloud.points->size(), 1e9);
  for (std::size_t i = 0; i < seeds.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j)
      EXPECT_GE(distance(cloud, seeds[i], seeds[j]), kSpacing * (1.0 - 1e-6));
    for (std::size_t k = 0; k < nearest_seed.size(); ++k)
      nearest_seed[k] =
          std::min(nearest_seed[k], distance(cloud, seeds[i], static_cast<int>(k)));
  }
  // Every point would be within one spacing if all pixels had been tried; those between
  // are a quarter of one apart, in rows whose distance on the floor is up to 0.13 m.
  for (const double d : nearest_seed)
    EXPECT_LT(d, 2.4 * kSpacing);
}

TEST(Seeds, OfAVoxelGridAreTheNearestToTheCentre)
{
  Random random;
  const RangeCloud cloud = makeScatteredCloud(random, 3000);
  const double size = 0.25;
  const Indices seeds = seedsOf(cloud, makeSeedOptions(SeedStrategy::Grid, size));
  const auto cellOf = [&](int i) -> Eigen::Vector3d {
    const Eigen::Vector3d p = (*cloud.points)[i].getVector3fMap().cast<double>();
    return (p / size).array().floor();
  };
  const auto offset = [&](int i) {
    const Eigen::Vector3d p = (*cloud.points)[i].getVector3fMap().cast<double>();
    return (p / size - cellOf(i) - Eigen::Vector3d::Constant(0.5)).norm();
  };
  for (const int i : finitePoints(cloud)) {
    const auto own = std::count_if(seeds.begin(), seeds.end(), [&](int seed) {
      return cellOf(seed) == cellOf(i) && offset(seed) <= offset(i);
    });
    EXPECT_EQ(own, 1) << "point " << i;
  }
}

TEST(Seeds, OfRandomChoiceAreUniform)
{
  auto points = pcl::make_shared<pcl::PointCloud<pcl::PointXYZ>>();
  constexpr int kPoints = 10;
  for (int i = 0; i < kPoints; ++i)
    points->push_back({0.1F * static_cast<float>(i), 0.0F, 1.0F});
  const RangeCloud cloud{points, {}, {}};
  SamplerOptions options = makeSeedOptions(SeedStrategy::Random, 0.1, 3);
  constexpr int kTrials = 5000;
  std::array<int, kPoints> count{};
  for (int trial = 0; trial < kTrials; ++trial) {
    options.random_seed = static_cast<std::uint64_t>(trial);
    for (const int seed : seedsOf(cloud, options))
      ++count[static_cast<std::size_t>(seed)];
  }
  // Binomial with p = 0.3; five standard deviations.
  const double expected = 0.3 * kTrials;
  for (const int n : count)
    EXPECT_NEAR(n, expected, 5.0 * std::sqrt(expected * 0.7));
}

TEST(Seeds, OfPoissonDiscAreSpacedAndLeaveNoRoom)
{
  Random random;
  const RangeCloud organized = makeRoughCloud(random);
  const RangeCloud scattered = makeScatteredCloud(random, 2000);
  const double spacing = 0.15;
  for (const RangeCloud& cloud : {organized, scattered}) {
    const Indices seeds =
        seedsOf(cloud, makeSeedOptions(SeedStrategy::Poisson, spacing));
    for (std::size_t i = 0; i < seeds.size(); ++i)
      for (std::size_t j = 0; j < i; ++j)
        EXPECT_GE(distance(cloud, seeds[i], seeds[j]), spacing * (1.0 - 1e-6));
    for (const int i : finitePoints(cloud))
      EXPECT_TRUE(std::any_of(seeds.begin(), seeds.end(), [&](int seed) {
        return distance(cloud, seed, i) < spacing * (1.0 + 1e-6);
      }));
  }
}

// ---- Degenerate input ----

const std::array<Neighborhood, 5> kNeighborhoods{Neighborhood::Patch,
                                                 Neighborhood::Disc,
                                                 Neighborhood::Ball,
                                                 Neighborhood::Geodesic,
                                                 Neighborhood::Knn};

TEST(Degenerate, CloudsWithoutValidPointsHaveNoSeedsAndNoNeighborhoods)
{
  const auto empty = pcl::make_shared<pcl::PointCloud<pcl::PointXYZ>>();
  const RangeCloud all_nan =
      makeOrganizedCloud(kCamera, [](int, int) { return std::nan(""); });
  auto row = pcl::make_shared<pcl::PointCloud<pcl::PointXYZ>>(*all_nan.points);
  row->width *= row->height;
  row->height = 1;
  for (const RangeCloud& cloud :
       {RangeCloud{empty, {}, {}}, all_nan, RangeCloud{row, {}, {}}}) {
    for (const SeedStrategy strategy : kStrategies)
      EXPECT_TRUE(seedsOf(cloud, makeSeedOptions(strategy, 0.1)).empty());
    if (cloud.points->empty())
      continue;
    for (const Neighborhood kind : kNeighborhoods)
      EXPECT_TRUE(neighborhoodOf(cloud, makeOptions(kind, 0.1), 0).empty());
  }
}

TEST(Degenerate, OnePointIsItsOwnNeighborhood)
{
  auto point = pcl::make_shared<pcl::PointCloud<pcl::PointXYZ>>();
  point->push_back({0.1F, 0.2F, 1.0F});
  const RangeCloud alone{point, {}, {}};
  const RangeCloud in_image = makeOrganizedCloud(kCamera, [](int u, int v) {
    return u == 3 && v == 2 ? 1.0 : std::nan("");
  });
  for (const RangeCloud& cloud : {alone, in_image}) {
    const int index = finitePoints(cloud).front();
    for (const Neighborhood kind : kNeighborhoods)
      EXPECT_EQ(neighborhoodOf(cloud, makeOptions(kind, 0.1), index), Indices{index});
    for (const SeedStrategy strategy : {SeedStrategy::Random, SeedStrategy::Poisson})
      EXPECT_EQ(seedsOf(cloud, makeSeedOptions(strategy, 0.1, 1)), Indices{index});
  }
}

TEST(Degenerate, RadiiBelowAPixelLeaveTheSeed)
{
  const RangeCloud cloud = makeOrganizedCloud(kCamera, [](int, int) { return 1.0; });
  for (const Neighborhood kind : {Neighborhood::Patch,
                                  Neighborhood::Disc,
                                  Neighborhood::Ball,
                                  Neighborhood::Geodesic})
    EXPECT_EQ(neighborhoodOf(cloud, makeOptions(kind, 1e-9), 77), Indices{77});
}

TEST(Degenerate, MisuseThrows)
{
  const RangeCloud cloud = makeOrganizedCloud(kCamera, [](int, int) { return 1.0; });
  const auto expectThrow = [&cloud](auto change) {
    SamplerOptions options;
    change(options);
    EXPECT_THROW(NeighborhoodSampler(cloud, makeSensor(kCamera), options),
                 std::invalid_argument);
  };
  expectThrow([](SamplerOptions& o) { o.radius_m = 0.0; });
  expectThrow([](SamplerOptions& o) { o.radius_m = std::nan(""); });
  expectThrow([](SamplerOptions& o) { o.k = 0; });
  expectThrow([](SamplerOptions& o) { o.max_seeds = -1; });
  expectThrow([](SamplerOptions& o) { o.spacing_m = -0.1; });
  expectThrow([](SamplerOptions& o) { o.max_patches = -1; });
  expectThrow([](SamplerOptions& o) { o.max_area_m2 = -1.0; });
  expectThrow([](SamplerOptions& o) { o.max_time_s = std::nan(""); });
  expectThrow([](SamplerOptions& o) { o.jump_sigmas = -1.0; });
  expectThrow([](SamplerOptions& o) { o.max_slope = INFINITY; });

  const NeighborhoodSampler sampler(cloud, makeSensor(kCamera), {});
  const auto scratch = sampler.makeScratch();
  Indices indices;
  EXPECT_THROW(sampler.neighborhood(-1, *scratch, indices), std::invalid_argument);
  EXPECT_THROW(sampler.neighborhood(80 * 60, *scratch, indices), std::invalid_argument);
  EXPECT_THROW(seedsOf({}, {}), std::invalid_argument);
  RangeCloud uneven = cloud;
  uneven.covariances = std::make_shared<const Covariances>(3);
  EXPECT_THROW(seedsOf(uneven, {}), std::invalid_argument);
}

}} // namespace holdfast
