// The map of patches: what becomes of measurements, and that nothing else decides.
#include "support/chi_square_bounds.h"
#include "support/random_patch.h"
#include "support/risk_map.h"
#include "support/spot.h"

#include <holdfast/fusion/patch_map.h>
#include <holdfast/fusion/pattern_reach.h>
#include <holdfast/fusion/registration.h>
#include <holdfast/geometry/rotation.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <limits>
#include <vector>

namespace holdfast { namespace {

using test::Random;

constexpr double kRadius = 0.05;

/// Standard deviations of a jet as a Kinect's patch of 5 cm has them at 1 m.
JetVector
jetSigmas()
{
  return (JetVector() << 6e-4, 0.01, 0.01, 0.6, 0.4, 0.6).finished();
}

JetMatrix
jetCovariance()
{
  return jetSigmas().cwiseAbs2().asDiagonal();
}

/// A measurement of a flat spot at a place of the sensor's frame, facing the sensor.
Measurement
measurementAt(std::uint64_t id, const Eigen::Vector3d& place, Random* noise = nullptr)
{
  Measurement m =
      test::groundMeasurement(id,
                              {frameFromZ(-Eigen::Vector3d::UnitZ()), place},
                              kRadius);
  m.jet.white = jetCovariance();
  if (noise)
    for (int i = 0; i < 6; ++i)
      m.jet.value[i] = jetSigmas()[i] * noise->normal();
  return m;
}

/// A wall of patches 6 cm apart, 1 m before the sensor.
std::vector<Measurement>
wall(int side, Random* noise = nullptr)
{
  std::vector<Measurement> measurements;
  for (int i = 0; i < side; ++i)
    for (int j = 0; j < side; ++j)
      measurements.push_back(
          measurementAt(measurements.size() + 1,
                        {0.06 * (i - 0.5 * side), 0.06 * (j - 0.5 * side), 1.0},
                        noise));
  return measurements;
}

bool
areEqual(const PatchMap& a, const PatchMap& b)
{
  if (a.patches().size() != b.patches().size())
    return false;
  for (std::size_t i = 0; i < a.patches().size(); ++i) {
    const MapPatch &p = a.patches()[i], &q = b.patches()[i];
    if (p.id != q.id || p.jet.value() != q.jet.value() ||
        p.jet.state().joint.v != q.jet.state().joint.v ||
        p.jet.state().by_third != q.jet.state().by_third ||
        p.support.rows() != q.support.rows() || p.moments != q.moments ||
        p.views != q.views)
      return false;
  }
  return true;
}

TEST(PatchMap, KeepsAPatchInAKibibyte)
{
  // Two chain links beside it.
  EXPECT_LE(sizeof(MapPatch) + 2 * sizeof(int), 1024u);
}

TEST(PatchMap, CountsEveryMeasurement)
{
  Random random;
  PatchMap map;
  const UpdateReport first = map.update(wall(5, &random));
  EXPECT_EQ(first.born, 25);
  const UpdateReport second = map.update(wall(5, &random));
  EXPECT_EQ(second.fused + second.gated, 25);
  EXPECT_GE(second.fused, 22);
  std::vector<Measurement> twice = wall(5);
  const Measurement same = twice.front();
  twice.push_back(same);
  twice.back().id = 100;
  twice.push_back(same);
  twice.back().id = 101;
  twice.back().jet.value[0] = std::numeric_limits<double>::quiet_NaN();
  const UpdateReport third = map.update(twice);
  EXPECT_EQ(third.surplus, 1);
  EXPECT_EQ(third.unfit, 1);
  EXPECT_EQ(third.fused + third.gated + third.surplus + third.unfit, 27);
  EXPECT_EQ(map.patches().size(), 25u);
}

TEST(PatchMap, DoesNotDependOnTheOrderOfMeasurements)
{
  for (std::uint64_t run = 0; run < 5; ++run) {
    Random random(run);
    PatchMap a, b;
    for (int frame = 0; frame < 4; ++frame) {
      std::vector<Measurement> measurements = wall(6, &random);
      a.update(measurements);
      std::shuffle(measurements.begin(), measurements.end(), random.engine());
      b.update(measurements);
    }
    EXPECT_TRUE(areEqual(a, b));
  }
}

TEST(PatchMap, IsTheSameInATurnedWorld)
{
  // The frame of the map is the first sensor's: nothing of the world is in it, and a
  // covariance of a motion turns with it.
  Random random;
  const Eigen::Matrix3d R = random.rotation();
  JetMatrix P = JetMatrix::Zero();
  P.diagonal() << 1e-6, 2e-6, 3e-6, 1e-7, 4e-7, 9e-7;
  Pose step{expMap({0.02, -0.01, 0.03}), {0.01, 0.02, -0.01}};
  PatchMap a, b;
  // b starts turned, by a motion that is known as well as a double can be.
  b.place({R, Eigen::Vector3d(1.0, 2.0, 3.0)}, 1e-30 * JetMatrix::Identity());
  const std::vector<Measurement> measurements = wall(3, &random);
  a.update(measurements);
  b.update(measurements);
  a.move(step, P);
  b.move(step, P);
  for (std::size_t i = 0; i < 9; ++i) {
    const JetMatrix S = a.patches()[i].jet.covariance(),
                    T = b.patches()[i].jet.covariance();
    const JetVector scale = S.diagonal().cwiseSqrt().cwiseInverse();
    EXPECT_LT((scale.asDiagonal() * (S - T) * scale.asDiagonal()).cwiseAbs().maxCoeff(),
              1e-9);
  }
}

// A camera that moves sees a spot through pixels whose pattern is that of the frame
// before in part, wherever an epoch began; at the end of one it is not new.
TEST(PatchMap, CountsWhatIsLeftOfThePattern)
{
  constexpr int kTrials = 400, kViews = 12;
  constexpr double kFocal = 525.0, kStep = 40.0 / kFocal, kPattern = 3e-3;
  PatchMapOptions options;
  options.pattern =
      patternReach(CorrelatedNoise({{{0.1, 79.0, PatternShape::Exponential}}}), kFocal);
  const Eigen::MatrixXd correlation =
      Eigen::MatrixXd::NullaryExpr(kViews, kViews, [&](Eigen::Index i, Eigen::Index j) {
        const double moved = kStep * static_cast<double>(std::abs(i - j));
        return patternCorrelation(options.pattern, 0.5 * kRadius, moved)[0];
      });
  const Eigen::MatrixXd root = kPattern * Eigen::MatrixXd(correlation.llt().matrixL());
  double squares = 0.0, variance = 0.0;
  int epochs = 0;
  for (std::uint64_t trial = 0; trial < kTrials; ++trial) {
    Random random(trial);
    const Eigen::VectorXd b =
        root * Eigen::VectorXd::NullaryExpr(kViews, [&] { return random.normal(); });
    PatchMap map(options);
    for (int view = 0; view < kViews; ++view) {
      if (view > 0)
        map.move({Eigen::Matrix3d::Identity(), {kStep, 0.0, 0.0}},
                 1e-12 * JetMatrix::Identity());
      Measurement m = measurementAt(1, {-kStep * view, 0.0, 1.0}, &random);
      m.jet.value[0] += b[view];
      m.jet.pattern(0, 0) = kPattern * kPattern;
      map.update({m});
    }
    ASSERT_EQ(map.patches().size(), 1u);
    const MapPatch& patch = map.patches().front();
    const double sigma2 = patch.jet.covariance()(0, 0);
    squares += patch.jet.value()[0] * patch.jet.value()[0] / sigma2 / kTrials;
    variance += sigma2 / kTrials;
    epochs = patch.epochs;
  }
  std::printf("  %d epochs, sigma %.2f mm of %.2f, NEES %.3f\n",
              epochs,
              1e3 * std::sqrt(variance),
              1e3 * kPattern,
              squares);
  EXPECT_GT(epochs, 2);
  const test::NeesBounds bounds(kTrials);
  EXPECT_LT(squares, bounds.highest);
  EXPECT_GT(squares, bounds.lowest);
}

TEST(PatchMap, ReplacesWhatIsContradicted)
{
  PatchMap map;
  map.update({measurementAt(1, {0.0, 0.0, 1.0})});
  const std::uint64_t old = map.patches().front().id;
  for (int frame = 0; frame < 3; ++frame) {
    const UpdateReport report = map.update({measurementAt(1, {0.0, 0.0, 1.02})});
    EXPECT_EQ(report.gated, frame < 2 ? 1 : 0);
    EXPECT_EQ(report.replaced, frame < 2 ? 0 : 1);
  }
  ASSERT_EQ(map.patches().size(), 1u);
  EXPECT_NE(map.patches().front().id, old);
  EXPECT_NEAR(map.patches().front().anchor.c.z(), 1.02, 1e-12);
}

TEST(PatchMap, ForgetsWhatIsSeenThroughAndWhatIsFar)
{
  PatchMapOptions options;
  options.volume_radius_m = 2.0;
  PatchMap map(options);
  map.update(wall(3));
  const std::uint64_t id = map.patches()[4].id;
  for (int frame = 0; frame < 3; ++frame)
    EXPECT_EQ(map.update({}, {id}).seen_through, 1);
  EXPECT_EQ(map.find(id), nullptr);
  EXPECT_EQ(map.patches().size(), 8u);
  Pose away;
  away.c.z() = -1.5;
  map.move(away, 1e-8 * JetMatrix::Identity());
  EXPECT_EQ(map.update({}).forgotten, 8);
  EXPECT_TRUE(map.patches().empty());
}

TEST(PatchMap, AsksForWhatTheCameraMaySee)
{
  PatchMap map;
  map.update(wall(3));
  Camera camera;
  const std::vector<WantedSeed> seeds = map.wantedSeeds(camera);
  ASSERT_EQ(seeds.size(), 9u);
  for (const WantedSeed& seed : seeds) {
    EXPECT_LT((camera.project(seed.position) - seed.pixel).norm(), 1e-12);
    EXPECT_EQ(seed.radius_m, kRadius);
    EXPECT_EQ(sightOf(seed, 1.0, 1e-3), Sight::Seen);
    EXPECT_EQ(sightOf(seed, 0.7, 1e-3), Sight::Hidden);
    EXPECT_EQ(sightOf(seed, 1.4, 1e-3), Sight::SeenThrough);
    EXPECT_EQ(sightOf(seed, std::nan(""), 1e-3), Sight::Hidden);
  }
  Pose back;
  back.R = expMap({0.0, 3.0, 0.0});
  map.move(back, 1e-10 * JetMatrix::Identity());
  EXPECT_TRUE(map.wantedSeeds(camera).empty());
}

TEST(PatchMap, RefusesMotionsThatAreClaims)
{
  PatchMap map;
  map.update(wall(3));
  const PatchMap before = map;
  const Pose still;
  EXPECT_THROW(map.move(still, JetMatrix::Zero()), std::invalid_argument);
  JetMatrix indefinite = 1e-6 * JetMatrix::Identity();
  indefinite(2, 2) = -1e-6;
  EXPECT_THROW(map.move(still, indefinite), std::invalid_argument);
  JetMatrix skewed = 1e-6 * JetMatrix::Identity();
  skewed(0, 1) = 1e-6;
  EXPECT_THROW(map.place(still, skewed), std::invalid_argument);
  Pose nan;
  nan.c.x() = std::nan("");
  EXPECT_THROW(map.move(nan, 1e-6 * JetMatrix::Identity()), std::invalid_argument);
  Pose scaled;
  scaled.R *= 1.01;
  EXPECT_THROW(map.move(scaled, 1e-6 * JetMatrix::Identity()), std::invalid_argument);
  std::vector<Measurement> equal_ids = wall(2);
  equal_ids[1].id = equal_ids[0].id;
  EXPECT_THROW(map.update(equal_ids), std::invalid_argument);
  EXPECT_TRUE(areEqual(map, before));
  PatchMapOptions options;
  options.gate_level = 0.0;
  EXPECT_THROW(PatchMap{options}, std::invalid_argument);
}

TEST(PatchMap, ComesBackFromASnapshot)
{
  Random random;
  PatchMap map;
  map.update(wall(4, &random));
  PatchMap copy(map.snapshot());
  const std::vector<Measurement> next = wall(4, &random);
  map.update(next);
  copy.update(next);
  EXPECT_TRUE(areEqual(map, copy));
}

// The patch of a map as a fit: its state is where the jet is.
TEST(PatchMap, GivesFitResults)
{
  const PatchEstimator estimator(test::paraboloidOptions());
  const Scene scene = test::reliefScene();
  int elliptic = 0;
  for (std::uint64_t run = 0; run < 20; ++run) {
    Random random(run);
    const Pose pose = test::randomView(random);
    const SpotView seen(scene, test::kinect(), pose, Pose(), kRadius, 2);
    PatchMap map;
    std::optional<Measurement> m;
    for (int frame = 0; frame < 4; ++frame) {
      m = seen.measure(estimator, random.engine());
      ASSERT_TRUE(m);
      map.update({*m});
    }
    const MapPatch& patch = map.patches().front();
    FitOptions options;
    options.surface = SurfaceRequest::Paraboloid;
    const FitResult fit = toFitResult(patch, options);
    ASSERT_TRUE(isUsable(fit.status));
    EXPECT_EQ(validityError(fit.patch), "");
    // Back again, the jet and its covariance are the same.
    const auto jet = jetAt(fit, patch.anchor);
    ASSERT_TRUE(jet);
    const JetVector sigma = patch.jet.covariance().diagonal().cwiseSqrt();
    EXPECT_LT(
        (jet->value - patch.jet.value()).cwiseQuotient(sigma).cwiseAbs().maxCoeff(),
        1e-6);
    const JetMatrix difference = sigma.cwiseInverse().asDiagonal() *
                                 (jet->covariance() - patch.jet.covariance()) *
                                 sigma.cwiseInverse().asDiagonal();
    // A height that moves takes the axis of the paraboloid along, which a jet at the
    // anchor cannot tell.
    EXPECT_LT(difference.cwiseAbs().maxCoeff(), 1e-2);
    EXPECT_NEAR(fit.patch.d[0], 1.1 * kRadius, 0.2 * kRadius);
    elliptic +=
        toFitResult(patch).patch.type.surface == SurfaceType::EllipticParaboloid;
  }
  EXPECT_GE(elliptic, 15);
}

// Flat measurements make a plane.
TEST(PatchMap, DecidesTypesOnFusedJets)
{
  Random random;
  PatchMap map;
  for (int frame = 0; frame < 8; ++frame)
    map.update(wall(4, &random));
  int planes = 0;
  for (const MapPatch& patch : map.patches()) {
    const FitResult fit = toFitResult(patch);
    ASSERT_TRUE(isUsable(fit.status));
    planes += fit.patch.type.surface == SurfaceType::Plane;
  }
  EXPECT_GE(planes, 14);
  FitOptions forced;
  forced.surface = SurfaceRequest::Sphere;
  EXPECT_THROW(toFitResult(map.patches().front(), forced), std::invalid_argument);
}

/// Patches of a rugged surface around the sensor, side by side: those that share points
/// would not each have noise of its own.
struct World {
  std::vector<Pose> anchors; ///< true, frame of the map
  std::vector<JetVector> jets;

  World(int count, double steepness, Random& random, double curvature = 5.0)
  {
    for (int i = 0; i < count; ++i) {
      constexpr int kColumns = 18;
      const Eigen::Vector3d place(2.0 * kRadius * (i % kColumns - 0.5 * kColumns),
                                  2.0 * kRadius * (i / kColumns - 0.5 * kColumns),
                                  random.uniform(0.9, 1.1));
      const double turn_x = steepness * random.normal();
      const double turn_y = steepness * random.normal();
      anchors.push_back(
          {expMap({turn_x, turn_y, 0.0}) * frameFromZ(-Eigen::Vector3d::UnitZ()),
           place});
      JetVector jet = JetVector::Zero();
      for (int k = 3; k < 6; ++k)
        jet[k] = curvature * random.normal();
      jets.push_back(jet);
    }
  }

  /// As seen from a pose, about anchors that are off by some millimetres.
  /// \param shift by which all are off, m, in the plane of each.
  std::vector<Measurement> measure(
      const Pose& sensor,
      Random& random,
      const Eigen::Vector2d& shift = Eigen::Vector2d::Zero()) const
  {
    std::vector<Measurement> measurements;
    for (std::size_t i = 0; i < anchors.size(); ++i) {
      Pose offset;
      offset.c.head<2>() = shift + 0.003 * random.normalVector().head<2>();
      const auto moved = movedJet(jets[i], offset);
      Measurement m = measurementAt(i + 1, {0.0, 0.0, 1.0}, &random);
      m.jet.value += moved->value;
      m.anchor = sensor.inverse() * (anchors[i] * offset);
      measurements.push_back(m);
    }
    return measurements;
  }
};

/// (delta, c) from a true pose to another.
JetVector
poseError(const Pose& truth, const Pose& pose)
{
  JetVector error;
  error << logMap(truth.R.transpose() * pose.R), pose.c - truth.c;
  return error;
}

// F9.
TEST(Registration, FindsThePoseWithItsCovariance)
{
  constexpr int kTrials = 60;
  double nees = 0.0;
  JetVector squares = JetVector::Zero();
  for (std::uint64_t trial = 0; trial < kTrials; ++trial) {
    Random random(trial);
    World world(300, 0.3, random);
    PatchMapOptions options;
    options.max_tilt_rad = 1.0;
    PatchMap map(options);
    map.update(world.measure(Pose(), random));
    const Pose truth{expMap(0.05 * random.normalVector()),
                     0.05 * random.normalVector()};
    const Pose guess{truth.R * expMap(0.005 * random.normalVector()),
                     truth.c + 0.005 * random.normalVector()};
    const std::vector<Measurement> frame = world.measure(truth, random);
    const RegistrationResult result = registerPatches(frame, map, guess);
    ASSERT_EQ(result.status, RegistrationStatus::Converged);
    EXPECT_EQ(result.null_space.cols(), 0);
    EXPECT_EQ(result.pairs + result.gated + result.unmatched, 300);
    JetVector error;
    error << logMap(truth.R.transpose() * result.pose.R), result.pose.c - truth.c;
    nees += error.dot(result.covariance.inverse() * error) / 6.0 / kTrials;
    squares += error.cwiseAbs2() / kTrials;
  }
  std::printf("  NEES/dof %.3f, rms %.3f mrad, %.3f mm\n",
              nees,
              1e3 * std::sqrt(squares.head<3>().mean()),
              1e3 * std::sqrt(squares.tail<3>().mean()));
  const test::NeesBounds bounds(6 * kTrials);
  EXPECT_LT(nees, bounds.highest);
  EXPECT_GT(nees, bounds.lowest);
}

// Off by up to several centimetres and some tens of milliradians: what is said to have
// converged is where it says, and stays there.
TEST(Registration, ConvergesWhereItSaysOrNot)
{
  constexpr int kTrials = 60;
  const double largest = test::largestOf(kTrials);
  int converged = 0;
  double nees = 0.0;
  for (std::uint64_t trial = 0; trial < kTrials; ++trial) {
    Random random(trial);
    const World world(300, 0.3, random);
    PatchMapOptions options;
    options.max_tilt_rad = 1.0;
    PatchMap map(options);
    map.update(world.measure(Pose(), random));
    const Pose truth{expMap(0.02 * random.normalVector()),
                     0.03 * random.normalVector()};
    const std::vector<Measurement> frame = world.measure(truth, random);
    for (const int most_iterations : {1, 5, 20}) {
      RegistrationOptions few;
      few.max_iterations = most_iterations;
      const RegistrationResult result = registerPatches(frame, map, Pose(), few);
      EXPECT_LE(result.iterations, most_iterations);
      if (result.status != RegistrationStatus::Converged)
        continue;
      const JetVector error = poseError(truth, result.pose);
      const double squared = error.dot(result.covariance.inverse() * error);
      EXPECT_LT(squared, largest);
      const RegistrationResult again = registerPatches(frame, map, result.pose);
      ASSERT_EQ(again.status, RegistrationStatus::Converged);
      const JetVector step = poseError(result.pose, again.pose);
      // As far as one average pair, with its share of the information, moves the pose
      // that comes or goes at the gate.
      const double one_pair = std::sqrt(6.0 / result.pairs * map.gate());
      EXPECT_LT(std::sqrt(step.dot(result.covariance.inverse() * step)), one_pair);
      if (most_iterations < 20)
        continue;
      ++converged;
      nees += squared / 6.0;
    }
  }
  std::printf("  %d of %d converged, NEES/dof %.3f\n",
              converged,
              kTrials,
              nees / converged);
  EXPECT_EQ(converged, kTrials);
  const test::NeesBounds bounds(6 * converged);
  EXPECT_LT(nees / converged, bounds.highest);
  EXPECT_GT(nees / converged, bounds.lowest);
}

// All heights of the second frame are off by the same: a pattern that reaches over the
// whole view. Counted once for each of 300 patches it would be claimed away.
TEST(Registration, CountsASharedErrorOnce)
{
  constexpr int kTrials = 60;
  constexpr double kShared = 2e-3; // m
  double nees = 0.0, height = 0.0, claimed = 0.0;
  for (std::uint64_t trial = 0; trial < kTrials; ++trial) {
    Random random(trial);
    const World world(300, 0.0, random);
    PatchMapOptions options;
    options.max_tilt_rad = 1.0;
    options.pattern = singleWave(100.0);
    PatchMap map(options);
    map.update(world.measure(Pose(), random));
    std::vector<Measurement> frame = world.measure(Pose(), random);
    const double shared = kShared * random.normal();
    for (Measurement& m : frame) {
      m.jet.value[0] += shared;
      m.jet.pattern(0, 0) = kShared * kShared;
    }
    const RegistrationResult result = registerPatches(frame, map, Pose());
    ASSERT_EQ(result.status, RegistrationStatus::Converged);
    JetVector error;
    error << logMap(result.pose.R), result.pose.c;
    nees += error.dot(result.covariance.inverse() * error) / 6.0 / kTrials;
    height += error[5] * error[5] / kTrials;
    claimed += result.covariance(5, 5) / kTrials;
  }
  std::printf("  NEES/dof %.3f; height %.3f mm, claimed %.3f mm\n",
              nees,
              1e3 * std::sqrt(height),
              1e3 * std::sqrt(claimed));
  EXPECT_LT(nees, 1.3);
  EXPECT_GT(claimed, 0.5 * kShared * kShared);
}

// What a wrong guess asks for lies beside the anchors, all of it to one side. With
// curvatures that are hardly more than their noise, this would draw the pose there.
TEST(Registration, IsNotPulledToItsGuess)
{
  constexpr int kTrials = 60;
  const Eigen::Vector2d shift(0.012, 0.0);
  double nees = 0.0, sum = 0.0, squares = 0.0;
  for (std::uint64_t trial = 0; trial < kTrials; ++trial) {
    Random random(trial);
    const World world(300, 0.0, random, 1.5);
    PatchMapOptions options;
    options.max_tilt_rad = 1.0;
    PatchMap map(options);
    map.update(world.measure(Pose(), random));
    Pose guess;
    guess.c = world.anchors.front().R * Eigen::Vector3d(-shift.x(), -shift.y(), 0.0);
    const RegistrationResult result =
        registerPatches(world.measure(Pose(), random, shift), map, guess);
    ASSERT_EQ(result.status, RegistrationStatus::Converged);
    ASSERT_EQ(result.null_space.cols(), 0);
    JetVector error;
    error << logMap(result.pose.R), result.pose.c;
    nees += error.dot(result.covariance.inverse() * error) / 6.0 / kTrials;
    const double pulled = error.tail<3>().dot(guess.c.normalized());
    sum += pulled;
    squares += pulled * pulled;
  }
  const double mean = sum / kTrials;
  const double deviation = std::sqrt((squares / kTrials - mean * mean) / (kTrials - 1));
  std::printf("  NEES/dof %.3f, pulled by %.3f +- %.3f mm of %.0f\n",
              nees,
              1e3 * mean,
              1e3 * deviation,
              1e3 * shift.norm());
  EXPECT_LT(std::abs(mean), 4.0 * deviation);
  EXPECT_LT(nees, 1.3);
}

TEST(Registration, SaysWhatAPlaneDoesNotTell)
{
  Random random;
  PatchMap map;
  map.update(wall(10, &random));
  Pose guess;
  guess.c = {0.002, -0.001, 0.004};
  const RegistrationResult result = registerPatches(wall(10, &random), map, guess);
  ASSERT_EQ(result.status, RegistrationStatus::Converged);
  // x, y and the turn about z are free, and stay as they were.
  ASSERT_EQ(result.null_space.cols(), 3);
  EXPECT_NEAR(result.pose.c.x(), guess.c.x(), 1e-4);
  EXPECT_NEAR(result.pose.c.y(), guess.c.y(), 1e-4);
  EXPECT_LT(std::abs(result.pose.c.z()), 4.0 * std::sqrt(result.covariance(5, 5)));
}

/// A plane of the map's frame with patches on it, seen from anywhere: each frame has
/// others, as a sensor finds them.
struct SeenPlane {
  Pose pose; ///< z along the normal, towards the sensor

  explicit SeenPlane(Random& random)
  {
    // The sensor looks along z of the map, from 0.6 to 1.6 m, tilted up to 0.9 rad.
    const double tilt = random.uniform(0.0, 0.9), turn = random.uniform(-3.0, 3.0);
    const Eigen::Vector3d axis(std::cos(turn), std::sin(turn), 0.0);
    pose = {expMap(tilt * axis) * frameFromZ(-Eigen::Vector3d::UnitZ()),
            {0.0, 0.0, random.uniform(0.6, 1.6)}};
  }

  std::vector<Measurement> measure(const Pose& sensor, Random& random) const
  {
    std::vector<Measurement> measurements;
    for (int i = -5; i <= 5; ++i)
      for (int j = -5; j <= 5; ++j) { // too far apart to share points
        const Pose anchor{
            pose.R * expMap(random.uniform(-3.0, 3.0) * Eigen::Vector3d::UnitZ()),
            pose.toWorld({0.12 * i, 0.12 * j, 0.0})};
        Measurement m =
            measurementAt(measurements.size() + 1, {0.0, 0.0, 1.0}, &random);
        m.anchor = sensor.inverse() * anchor;
        measurements.push_back(m);
      }
    return measurements;
  }
};

// F9. Along the plane and about its normal nothing is known, whatever the plane: these
// directions stay as they were, the other three are found with their covariance.
TEST(Registration, SaysWhatNoPlaneTells)
{
  constexpr int kTrials = 60;
  double nees = 0.0;
  for (std::uint64_t trial = 0; trial < kTrials; ++trial) {
    Random random(trial);
    const SeenPlane plane(random);
    PatchMapOptions options;
    options.max_tilt_rad = 1.2;
    PatchMap map(options);
    map.update(plane.measure(Pose(), random));
    const Pose truth{expMap(0.005 * random.normalVector()),
                     0.005 * random.normalVector()};
    const RegistrationResult result =
        registerPatches(plane.measure(truth, random), map, Pose());
    ASSERT_EQ(result.status, RegistrationStatus::Converged);
    ASSERT_EQ(result.null_space.cols(), 3);

    Eigen::Matrix<double, 6, 3> free = Eigen::Matrix<double, 6, 3>::Zero();
    free.block<3, 2>(3, 0) = plane.pose.R.leftCols<2>();
    free.block<3, 1>(0, 2) = result.pose.R.transpose() * plane.pose.R.col(2);
    // The normal is known as well as slopes are on average, which turns each of three
    // directions towards each of the others: nine numbers.
    const double known = 5.0 * jetSigmas()[1] * std::sqrt(9.0 / 121.0);
    const Eigen::Matrix<double, 6, 6> basis =
        Eigen::HouseholderQR<Eigen::Matrix<double, 6, 3>>(result.null_space)
            .householderQ();
    const auto N = basis.leftCols<3>(), told = basis.rightCols<3>();
    EXPECT_LT((free - N * (N.transpose() * free)).norm(), known);
    const JetVector step = poseError(Pose(), result.pose);
    // The step turns the directions along which it was none.
    const double turned = known + step.head<3>().norm();
    EXPECT_LT((free.transpose() * step).norm(), turned * step.norm());

    const Eigen::Vector3d error = told.transpose() * poseError(truth, result.pose);
    const Eigen::Matrix3d covariance = told.transpose() * result.covariance * told;
    nees += error.dot(covariance.inverse() * error) / 3.0 / kTrials;
  }
  std::printf("  NEES/dof %.3f\n", nees);
  const test::NeesBounds bounds(3 * kTrials);
  EXPECT_LT(nees, bounds.highest);
  EXPECT_GT(nees, bounds.lowest);
}

TEST(Registration, StaysWithTheGuessWithoutPairs)
{
  PatchMap map;
  Pose guess;
  guess.c.x() = 0.1;
  EXPECT_EQ(registerPatches({}, map, guess).status, RegistrationStatus::TooFewPairs);
  map.update(wall(2));
  const RegistrationResult result = registerPatches(wall(2), map, Pose());
  EXPECT_EQ(result.status, RegistrationStatus::TooFewPairs);
  EXPECT_TRUE(result.pose.R.isIdentity(0.0));
}

}} // namespace holdfast
