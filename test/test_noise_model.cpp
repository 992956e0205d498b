#include <holdfast/geometry/gaussian.h>
#include <holdfast/sensor/dryanovski_noise_model.h>
#include <holdfast/sensor/khoshelham_noise_model.h>
#include <holdfast/sensor/noise_registry.h>
#include <holdfast/sensor/parameter_error.h>
#include <holdfast/sensor/stereo_noise_model.h>
#include <holdfast/sensor/time_of_flight_noise_model.h>

#include "support/random.h"

#include <array>
#include <cmath>
#include <limits>

namespace holdfast { namespace {

const double kNaN = std::numeric_limits<double>::quiet_NaN();

/// Every registered model, with all parameters at plausible values.
std::vector<NoiseModel::ConstPtr>
allModels()
{
  const NoiseParameters values{{"sigma_point_px", 0.35},
                               {"sigma_disparity_px", 0.17},
                               {"baseline_m", 0.075},
                               {"focal_px", 580.0},
                               {"sigma_m", 0.002},
                               {"sigma_lateral_m", 0.0005},
                               {"sigma_per_m", 0.003},
                               {"sigma_per_m2", 0.0015},
                               {"sigma_lateral_rad", 0.0007},
                               {"sigma_z_per_m2", 0.001425},
                               {"best_depth_m", 0.8},
                               {"sigma_incidence_m", 0.0001}};
  std::vector<NoiseModel::ConstPtr> models;
  for (const NoiseModelKind& kind : noiseModelKinds()) {
    NoiseParameters parameters;
    for (const NoiseParameter& parameter : kind.parameters)
      parameters[parameter.name] = values.at(parameter.name);
    models.push_back(makeNoiseModel(kind.name, parameters));
  }
  return models;
}

Eigen::Vector3d
randomPoint(test::Random& random)
{
  // Up to 60 degrees off the axis, much more than any depth camera.
  const double z = random.uniform(0.3, 8.0);
  return {z * random.uniform(-1.7, 1.7), z * random.uniform(-1.7, 1.7), z};
}

/// Relative to the largest entry.
double
relativeDifference(const Eigen::Matrix3d& a, const Eigen::Matrix3d& b)
{
  return (a - b).cwiseAbs().maxCoeff() / b.cwiseAbs().maxCoeff();
}

TEST(StereoNoise, IsTheFirstOrderPropagationOfPixelAndDisparity)
{
  test::Random random;
  for (int i = 0; i < 200; ++i) {
    StereoNoiseModel::Parameters p;
    p.sigma_point_px = random.uniform(0.0, 1.0);
    p.sigma_disparity_px = random.uniform(0.01, 0.5);
    p.baseline_m = random.uniform(0.03, 0.3);
    p.focal_px = random.uniform(300.0, 1200.0);
    const auto measured = [&](const Eigen::Vector3d& uvd) -> Eigen::Vector3d {
      const double z = p.focal_px * p.baseline_m / uvd.z();
      return {uvd.x() * z / p.focal_px, uvd.y() * z / p.focal_px, z};
    };
    const Eigen::Vector3d q = randomPoint(random);
    const Eigen::Vector3d uvd(p.focal_px * q.x() / q.z(),
                              p.focal_px * q.y() / q.z(),
                              p.focal_px * p.baseline_m / q.z());
    Eigen::Matrix3d J;
    for (int axis = 0; axis < 3; ++axis) {
      const double h = 1e-5 * uvd.z();
      J.col(axis) = (measured(uvd + h * Eigen::Vector3d::Unit(axis)) -
                     measured(uvd - h * Eigen::Vector3d::Unit(axis))) /
                    (2.0 * h);
    }
    const Eigen::Vector3d sigmas(p.sigma_point_px,
                                 p.sigma_point_px,
                                 p.sigma_disparity_px);
    const Eigen::Matrix3d expected =
        J * sigmas.cwiseAbs2().asDiagonal() * J.transpose();
    // Truncation of the central difference: (h / disparity)^2 = 1e-10; rounding of the
    // difference quotient: 1e-16 |q| / (1e-5 |q|) = 1e-11.
    EXPECT_LT(relativeDifference(StereoNoiseModel(p).covariance(q), expected), 1e-8);
  }
}

TEST(StereoNoise, KinectAtOneMetre)
{
  const Eigen::Matrix3d Sigma = StereoNoiseModel({}).covariance({0.0, 0.0, 1.0});
  // sigma_z = sigma_d z^2 / (f b) = 0.17 / 43.5 m, sigma_x = 0.35 / 580 m.
  EXPECT_NEAR(std::sqrt(Sigma(2, 2)), 3.908e-3, 1e-6);
  EXPECT_NEAR(std::sqrt(Sigma(0, 0)), 6.034e-4, 1e-7);
  EXPECT_EQ(Sigma(0, 2), 0.0);
}

TEST(NoiseModels, AreSymmetricAndPositiveSemiDefiniteEverywhere)
{
  for (const auto& model : allModels()) {
    SCOPED_TRACE(model->name());
    test::Random random;
    for (int i = 0; i < 500; ++i) {
      const Eigen::Matrix3d Sigma = model->covariance(randomPoint(random));
      EXPECT_EQ(Sigma, Sigma.transpose());
      EXPECT_TRUE(isPositiveSemiDefinite(Sigma, 1e-14));
      EXPECT_GT(Sigma.trace(), 0.0);
    }
  }
}

TEST(NoiseModels, BatchEqualsSinglePoints)
{
  for (const auto& model : allModels()) {
    SCOPED_TRACE(model->name());
    test::Random random;
    constexpr std::size_t n = 37;
    std::array<double, n> x, y, z;
    for (std::size_t i = 0; i < n; ++i) {
      const Eigen::Vector3d q = randomPoint(random);
      x[i] = q.x();
      y[i] = q.y();
      z[i] = q.z();
    }
    std::array<std::array<double, n>, 6> c;
    model->covariances(
        n,
        x.data(),
        y.data(),
        z.data(),
        {c[0].data(), c[1].data(), c[2].data(), c[3].data(), c[4].data(), c[5].data()});
    for (std::size_t i = 0; i < n; ++i) {
      Eigen::Matrix3d batch;
      batch << c[0][i], c[1][i], c[2][i], c[1][i], c[3][i], c[4][i], c[2][i], c[4][i],
          c[5][i];
      // The order of the products may differ, nothing else.
      EXPECT_LT(relativeDifference(batch, model->covariance({x[i], y[i], z[i]})),
                1e-14);
    }
  }
}

TEST(RangeModels, HaveTheirSigmasAlongAndAcrossTheRay)
{
  struct Case {
    std::string name;
    NoiseParameters parameters;
    double (*along)(double);
    double (*across)(double);
  };
  const std::vector<Case> cases{
      {"constant",
       {{"sigma_m", 0.002}},
       [](double) { return 0.002; },
       [](double) { return 0.002; }},
      {"constant",
       {{"sigma_m", 0.002}, {"sigma_lateral_m", 0.0}},
       [](double) { return 0.002; },
       [](double) { return 0.0; }},
      {"linear",
       {{"sigma_m", 0.001}, {"sigma_per_m", 0.003}, {"sigma_lateral_rad", 0.0005}},
       [](double r) { return 0.001 + 0.003 * r; },
       [](double r) { return 0.0005 * r; }},
      {"quadratic",
       {{"sigma_per_m2", 0.003}, {"sigma_lateral_rad", 0.0005}},
       [](double r) { return 0.003 * r * r; },
       [](double r) { return 0.0005 * r; }}};
  for (const Case& c : cases) {
    SCOPED_TRACE(c.name);
    test::Random random;
    const auto model = makeNoiseModel(c.name, c.parameters);
    for (int i = 0; i < 50; ++i) {
      const Eigen::Vector3d q = randomPoint(random);
      const Eigen::Vector3d ray = q.normalized();
      const Eigen::Vector3d side = ray.cross(random.unitVector()).normalized();
      const Eigen::Matrix3d Sigma = model->covariance(q);
      // Rounding of variances below 1 m^2.
      EXPECT_NEAR(ray.dot(Sigma * ray), std::pow(c.along(q.norm()), 2), 1e-15);
      EXPECT_NEAR(side.dot(Sigma * side), std::pow(c.across(q.norm()), 2), 1e-15);
      EXPECT_NEAR(side.dot(Sigma * ray), 0.0, 1e-15);
    }
  }
}

TEST(KhoshelhamNoise, GrowsWithTheSquareOfTheDepthAlongTheRay)
{
  KhoshelhamNoiseModel::Parameters parameters;
  parameters.sigma_point_px = 0.0;
  const KhoshelhamNoiseModel model(parameters);
  const Eigen::Vector3d q(0.6, -0.9, 3.0);
  const Eigen::Matrix3d Sigma = model.covariance(q);
  const double sigma_z = 1.425e-3 * 9.0;
  EXPECT_NEAR(Sigma(2, 2), sigma_z * sigma_z, 1e-18);
  // Rank one: sigma_x = |x/z| sigma_z, fully correlated.
  EXPECT_NEAR(Sigma(0, 0), std::pow(0.2 * sigma_z, 2), 1e-18);
  EXPECT_NEAR(Sigma(0, 1), -0.2 * 0.3 * sigma_z * sigma_z, 1e-18);
}

/// Points of a 3x3 image with these depths, seen by a camera of 500 px.
std::vector<Eigen::Vector3d>
window(const std::array<double, 9>& depths)
{
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < 9; ++i) {
    const double z = depths[static_cast<std::size_t>(i)];
    points.emplace_back((20.0 + i % 3) / 500.0 * z, (-30.0 + i / 3) / 500.0 * z, z);
  }
  return points;
}

TEST(DryanovskiNoise, IsItsBaseOnAFrontoParallelPlane)
{
  const KhoshelhamNoiseModel base({});
  const auto points = window({2, 2, 2, 2, 2, 2, 2, 2, 2});
  const auto result = mixtureCovariances(points, 3, 3, base);
  for (std::size_t i = 0; i < points.size(); ++i)
    // The result is single precision.
    EXPECT_LT(relativeDifference(result[i].cast<double>(), base.covariance(points[i])),
              1e-6);
}

TEST(DryanovskiNoise, DepthVarianceIsThatOfTheMixture)
{
  const KhoshelhamNoiseModel base({});
  const std::array<double, 9> z{1.0, 1.1, 1.2, 1.0, 1.1, 2.0, 0.9, 1.1, 2.1};
  const std::array<double, 9> w{1, 2, 1, 2, 4, 2, 1, 2, 1};
  double mean = 0.0, second = 0.0;
  for (std::size_t i = 0; i < 9; ++i) {
    const double sigma = 1.425e-3 * z[i] * z[i];
    mean += w[i] / 16.0 * z[i];
    second += w[i] / 16.0 * (sigma * sigma + z[i] * z[i]);
  }
  const Eigen::Matrix3f Sigma = mixtureCovariances(window(z), 3, 3, base)[4];
  EXPECT_NEAR(Sigma(2, 2), second - mean * mean, 1e-7 * second);
  EXPECT_TRUE(isPositiveSemiDefinite(Sigma));
}

TEST(DryanovskiNoise, SkipsInvalidNeighboursAndKeepsInvalidPixelsInvalid)
{
  const KhoshelhamNoiseModel base({});
  const std::array<double, 9> z{kNaN, kNaN, kNaN, kNaN, 1.0, 1.5, kNaN, kNaN, -1.0};
  const auto result = mixtureCovariances(window(z), 3, 3, base);
  for (const std::size_t i : {0, 1, 2, 3, 6, 7, 8})
    EXPECT_TRUE(result[i].array().isNaN().all());
  // Left: weights 4 and 2 of 6 on depths 1 and 1.5, hence a variance of 1/18.
  const double within =
      1.425e-3 * 1.425e-3 * (4.0 / 6.0 + 2.0 / 6.0 * std::pow(1.5, 4));
  EXPECT_NEAR(result[4](2, 2), within + 1.0 / 18.0, 1e-7);
}

TEST(DryanovskiNoise, IsTheImageModelAndTheBaseForSinglePoints)
{
  const auto base =
      std::make_shared<KhoshelhamNoiseModel>(KhoshelhamNoiseModel::Parameters{});
  const DryanovskiNoiseModel model(base);
  const auto points = window({1, 1, 1, 1, 2, 2, 2, 2, 2});
  EXPECT_EQ(model.covariance(points[4]), base->covariance(points[4]));
  const auto image = model.imageCovariances(points, 3, 3);
  EXPECT_EQ(image[4], mixtureCovariances(points, 3, 3, *base)[4]);
  EXPECT_GT(image[4](2, 2), 10.0 * base->imageCovariances(points, 3, 3)[4](2, 2));
  EXPECT_THROW(model.imageCovariances(points, 3, 2), std::invalid_argument);
  EXPECT_THROW(base->imageCovariances(points, -3, -3), std::invalid_argument);
  EXPECT_THROW(DryanovskiNoiseModel(nullptr), std::invalid_argument);
}

/// As published: mm of a depth in m.
double
fankhauser(double z, double theta)
{
  const double right = std::acos(0.0);
  return 1.5 - 0.5 * z + 0.3 * z * z +
         0.1 * std::pow(z, 1.5) * theta * theta / std::pow(right - theta, 2);
}

TEST(TimeOfFlightNoise, HasThePublishedDepthNoiseAlongTheRay)
{
  test::Random random;
  TimeOfFlightNoiseModel::Parameters parameters;
  parameters.sigma_point_px = 0.0;
  const TimeOfFlightNoiseModel model(parameters);
  for (int i = 0; i < 50; ++i) {
    const Eigen::Vector3d q = randomPoint(random);
    const double theta = random.uniform(0.0, 1.39); // below 80 degrees
    const double sigma_z = 1e-3 * fankhauser(q.z(), theta);
    const Eigen::Vector3d along = sigma_z / q.z() * q;
    EXPECT_LT(relativeDifference(model.covariance(q, theta), along * along.transpose()),
              1e-12);
    EXPECT_EQ(model.covariance(q), model.covariance(q, 0.0));
    // Nothing is worse than 80 degrees.
    EXPECT_EQ(model.covariance(q, 1.45), model.covariance(q, std::acos(0.0)));
  }
}

/// Points of an image of a camera of 365 px on the plane n^T q = 1.
std::vector<Eigen::Vector3d>
planeImage(const Eigen::Vector3d& n, int width, int height)
{
  std::vector<Eigen::Vector3d> points;
  for (int v = 0; v < height; ++v)
    for (int u = 0; u < width; ++u) {
      const Eigen::Vector3d ray((u - 40.0) / 365.0, (v - 5.0) / 365.0, 1.0);
      points.push_back(ray / n.dot(ray));
    }
  return points;
}

TEST(TimeOfFlightNoise, ImagesHaveTheIncidenceOfTheirPlanes)
{
  const TimeOfFlightNoiseModel model({});
  for (const double degrees : {0.0, 30.0, 60.0, 75.0}) {
    SCOPED_TRACE(degrees);
    const double angle = degrees / 90.0 * std::acos(0.0);
    const Eigen::Vector3d normal(std::sin(angle), 0.0, std::cos(angle));
    const auto points = planeImage(normal / (1.5 * std::cos(angle)), 30, 20);
    const auto image = model.imageCovariances(points, 30, 20);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const double theta =
          std::acos(std::min(1.0, std::abs(normal.dot(points[i].normalized()))));
      // The result is single precision; an angle near zero has half of the digits.
      EXPECT_LT(relativeDifference(image[i].cast<double>(),
                                   model.covariance(points[i], theta)),
                1e-6);
    }
  }
}

TEST(TimeOfFlightNoise, OtherSurfacesAndHolesDoNotTiltAPixel)
{
  const TimeOfFlightNoiseModel model({});
  auto points = planeImage({0.0, 0.0, 1.0}, 30, 20);
  for (std::size_t i = 0; i < points.size(); ++i)
    if (i % 30 >= 15)
      points[i] *= 1.5; // a step
  points[33] = Eigen::Vector3d::Constant(kNaN);
  const auto image = model.imageCovariances(points, 30, 20);
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (i == 33) {
      EXPECT_TRUE(image[i].array().isNaN().all());
      continue;
    }
    const double theta = std::acos(std::min(1.0, points[i].normalized().z()));
    EXPECT_LT(
        relativeDifference(image[i].cast<double>(), model.covariance(points[i], theta)),
        1e-6);
  }
  EXPECT_EQ(model.imageCovariances({points[0]}, 1, 1)[0],
            model.covariance(points[0]).cast<float>())
      << "alone: facing";
  EXPECT_THROW(model.imageCovariances(points, 3, 2), std::invalid_argument);
}

TEST(NoiseModels, RotateWithTheFrame)
{
  test::Random random;
  const StereoNoiseModel model({});
  const Eigen::Matrix3d R = random.rotation();
  const Eigen::Matrix3d Sigma = model.covariance(randomPoint(random));
  const Eigen::Matrix3d rotated = rotateCovariance(R, Sigma);
  EXPECT_EQ(rotated, rotated.transpose());
  const Eigen::Vector3d direction = random.unitVector();
  EXPECT_NEAR((R * direction).dot(rotated * R * direction),
              direction.dot(Sigma * direction),
              1e-15 * Sigma.trace());
}

/// The message of the std::invalid_argument thrown by makeNoiseModel, or "".
std::string
complaint(const std::string& name, const NoiseParameters& parameters)
{
  try {
    makeNoiseModel(name, parameters);
  }
  catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}

TEST(NoiseRegistry, NamesWhatIsWrong)
{
  EXPECT_EQ(complaint("magic", {}), "unknown noise model magic");
  EXPECT_EQ(complaint("constant", {}), "constant noise needs sigma_m");
  EXPECT_EQ(complaint("constant", {{"sigma_m", 1.0}, {"focal_px", 1.0}}),
            "constant noise has no parameter focal_px");
  EXPECT_EQ(complaint("constant", {{"sigma_m", -1.0}}),
            "sigma_m must be a finite number >= 0");
  EXPECT_EQ(complaint("khoshelham", {{"sigma_point_px", 0.0}, {"focal_px", 0.0}}),
            "focal_px must be a finite number > 0");
  EXPECT_EQ(complaint("constant", {{"sigma_m", kNaN}}),
            "sigma_m must be a finite number >= 0");
}

TEST(NoiseRegistry, EveryParameterOfEveryModelIsChecked)
{
  for (const NoiseModelKind& kind : noiseModelKinds()) {
    for (const NoiseParameter& bad : kind.parameters) {
      SCOPED_TRACE(kind.name + " " + bad.name);
      NoiseParameters parameters;
      for (const NoiseParameter& parameter : kind.parameters)
        parameters[parameter.name] = parameter.name == bad.name ? -1.0 : 1.0;
      try {
        makeNoiseModel(kind.name, parameters);
        FAIL() << "accepted";
      }
      catch (const ParameterError& error) {
        EXPECT_EQ(error.parameter(), bad.name);
      }
    }
  }
}

}} // namespace holdfast
