/// \file The fit of any points, covariances and options.
///
/// The bytes choose options, an arrangement of points and its scale, then spoil single
/// points; coordinates come from a generator that they seed. So a change of one byte is
/// a change of one choice.
#include "fuzz.h"
#include <holdfast/geometry/constants.h>
#include <holdfast/patch_estimator.h>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>
#include <vector>

namespace {

using namespace holdfast;
using fuzz::require;

/// The bytes one after the other, zeros behind the last.
class Bytes {
public:
  Bytes(const std::uint8_t* data, std::size_t size) : data_(data), left_(size) {}

  bool empty() const
  {
    return left_ == 0;
  }

  template <typename T>
  T take()
  {
    T value{};
    const std::size_t n = std::min(left_, sizeof(T));
    if (n > 0)
      std::memcpy(&value, data_, n);
    data_ += n;
    left_ -= n;
    return value;
  }

  int below(int n)
  {
    return take<std::uint8_t>() % n;
  }

  bool bit()
  {
    return below(2) == 1;
  }

  template <std::size_t n>
  double oneOf(const std::array<double, n>& values)
  {
    return values[take<std::uint8_t>() % n];
  }

private:
  const std::uint8_t* data_;
  std::size_t left_;
};

FitOptions
takeOptions(Bytes& bytes)
{
  FitOptions options = bytes.bit() ? FitOptions::paper() : FitOptions{};
  options.surface = static_cast<SurfaceRequest>(
      bytes.below(static_cast<int>(SurfaceRequest::CircularParaboloid) + 1));
  const bool has_choice = options.surface == SurfaceRequest::Plane ||
                          options.surface == SurfaceRequest::Auto;
  if (const int boundary = bytes.below(5); boundary < 4 && has_choice)
    options.plane_boundary = static_cast<BoundaryType>(boundary);
  const auto flags = bytes.take<std::uint8_t>();
  if ((flags & 1U) != 0) {
    options.residual = (flags & 2U) != 0 ? Residual::Ray : Residual::Sampson;
    options.debias_scatter = (flags & 4U) != 0;
    options.normal_from_pca = (flags & 8U) != 0;
    options.smooth_circle_radius = (flags & 16U) != 0;
    options.statistical_discrimination = (flags & 32U) != 0;
  }
  // The last of each is any number, and mostly refused.
  const auto any = [&](auto usual) {
    const double chosen = bytes.oneOf(usual);
    return chosen == 0.0 ? bytes.take<double>() : chosen;
  };
  options.containment = any(std::array{0.95, 0.5, 0.9, 0.999, 0.1, 0.0});
  options.discrimination_level = any(std::array{0.01, 0.5, 1e-6, 0.0});
  options.curvature_tolerance_per_m = any(std::array{0.1, 1e-3, 10.0, 0.0});
  options.sigma_floor_m = any(std::array{1e-6, 1e-9, 1e-3, 0.0});
  options.max_curvature_per_m = any(std::array{1e3, 1e9, 1.0, 0.0});
  options.max_iterations = 1 + bytes.below(40);
  return options;
}

/// A point of one of several arrangements, about as large as 1.
Eigen::Vector3d
arranged(int arrangement, double u, double v, double noise)
{
  switch (arrangement) {
  case 0: // anywhere
    return {u, v, 100.0 * noise};
  case 1: // a line
    return {u, 0.5 * u, -u};
  case 2: // a plane, exactly
    return {u, v, 0.25 * u - 0.5 * v};
  case 3: // few different places
    return {std::round(u), std::round(v), 0.0};
  case 4: // a cap of a sphere
    return {0.6 * u, 0.6 * v, std::sqrt(1.0 - 0.36 * (u * u + v * v)) + noise};
  case 5: // a saddle
    return {u, v, u * u - 0.5 * v * v + noise};
  case 6: // a trough
    return {u, v, 0.5 * v * v + noise};
  case 7: // a bowl, twice as bent one way
    return {u, v, 0.5 * u * u + v * v + noise};
  default: // a plane with noise
    return {u, 0.3 * v, noise};
  }
}

Eigen::Matrix3d
takeCovariance(Bytes& bytes, double scale, std::mt19937_64& random)
{
  const double sigma = scale * bytes.oneOf(std::array{1e-2, 1e-3, 1e-5, 0.3, 1e-8});
  const Eigen::Matrix3d isotropic = sigma * sigma * Eigen::Matrix3d::Identity();
  std::normal_distribution<double> normal;
  switch (bytes.below(5)) {
  case 1: { // of any shape
    Eigen::Matrix3d root;
    for (double& entry : root.reshaped())
      entry = sigma * normal(random);
    return root * root.transpose();
  }
  case 2: { // along one ray alone
    const Eigen::Vector3d ray(normal(random), normal(random), normal(random));
    return sigma * sigma * ray * ray.transpose();
  }
  case 3:
    return Eigen::Matrix3d::Zero();
  case 4:
    return 1e12 * isotropic;
  default:
    return isotropic;
  }
}

struct Point {
  Eigen::Vector3d place;
  Eigen::Matrix3d covariance;
};

/// Each two bytes left spoil one point.
void
spoil(Bytes& bytes, std::vector<Point>& points)
{
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  while (!bytes.empty() && !points.empty()) {
    Point& point = points[bytes.take<std::uint8_t>() % points.size()];
    switch (bytes.below(8)) {
    case 0:
      point.place.x() = kNan;
      break;
    case 1:
      point.place.z() = kInfinity;
      break;
    case 2:
      point.covariance(1, 1) = kNan;
      break;
    case 3:
      point.covariance *= -1.0;
      break;
    case 4:
      point.covariance.setZero();
      break;
    case 5:
      point.covariance *= 1e12;
      break;
    case 6:
      point.place = points.front().place;
      break;
    default:
      point.place *= 10.0;
    }
  }
}

std::vector<Point>
takePoints(Bytes& bytes)
{
  const double scale = std::pow(10.0, bytes.below(13) - 6);
  const double distance =
      scale * bytes.oneOf(std::array{0.0, 10.0, 1.0, 1e3, 1e6, -5.0});
  const double roughness = bytes.oneOf(std::array{0.0, 1e-2, 1e-3, 1e-6, 0.3});
  const int arrangement = bytes.below(9);
  const int n = bytes.below(80);
  std::mt19937_64 random(bytes.take<std::uint32_t>());
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  std::normal_distribution<double> normal;
  const Eigen::Quaterniond turn = bytes.bit() ? Eigen::Quaterniond::Identity() :
                                                Eigen::Quaterniond(normal(random),
                                                                   normal(random),
                                                                   normal(random),
                                                                   normal(random))
                                                    .normalized();
  const Eigen::Matrix3d covariance = takeCovariance(bytes, scale, random);
  std::vector<Point> points;
  for (int i = 0; i < n; ++i) {
    const double u = uniform(random), v = uniform(random);
    const Eigen::Vector3d local =
        arranged(arrangement, u, v, roughness * normal(random));
    points.push_back(
        {turn * (scale * local) + Eigen::Vector3d(0.0, 0.0, distance), covariance});
  }
  spoil(bytes, points);
  return points;
}

/// Symmetric to rounding. Positive semi-definite: no eigenvalue of the correlations
/// below -1e-6. They are free of units; 1e-6 is what normal equations of condition 1e10
/// leave of double precision, and changes no sigma by a millionth.
void
requireCovariance(const ParameterMatrix& covariance)
{
  require(covariance.allFinite(), "a usable covariance is finite");
  const Eigen::VectorXd variances = covariance.diagonal();
  require((variances.array() >= 0.0).all(), "variances are not negative");
  const Eigen::VectorXd sigma = variances.cwiseSqrt();
  Eigen::MatrixXd correlation = covariance;
  for (Eigen::Index i = 0; i < sigma.size(); ++i)
    for (Eigen::Index j = 0; j < sigma.size(); ++j) {
      const bool known = sigma(i) > 0.0 && sigma(j) > 0.0;
      require(known || covariance(i, j) == 0.0, "what has no variance has no relation");
      correlation(i, j) = known ? covariance(i, j) / sigma(i) / sigma(j) : 0.0;
    }
  require((correlation - correlation.transpose()).cwiseAbs().maxCoeff() <= 1e-9,
          "a covariance is symmetric");
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(correlation,
                                                              Eigen::EigenvaluesOnly);
  require(solver.eigenvalues().minCoeff() >= -1e-6,
          "a covariance is positive semi-definite");
}

void
requireRefusal(PointBatch& batch, const FitOptions& options, CovarianceMode mode)
{
  try {
    estimatePatch(batch, options, mode);
  }
  catch (const std::invalid_argument&) {
    return;
  }
  require(false, "options that make no sense are refused");
}

void
requireUsable(const FitResult& result)
{
  const Patch& patch = result.patch;
  const ParameterVector parameters = pack(patch);
  require(parameters.allFinite(), "a usable patch is finite");
  require(result.covariance.rows() == parameters.size() &&
              result.covariance.cols() == parameters.size(),
          "a covariance has a row and a column for each parameter");
  require(curvatureParameterCount(patch.type.surface) < 2 ||
              std::abs(patch.kappa.x()) <= std::abs(patch.kappa.y()),
          "|kappa_x| <= |kappa_y|");
  require(patch.r.norm() <= kPi * (1.0 + 1e-12), "|r| <= pi");
  const int bounds = boundaryParameterCount(patch.type.boundary);
  require((patch.d.head(bounds).array() > 0.0).all(), "bounds are positive");
  require(validityError(patch).empty(), "a usable patch is valid");
  require(std::isfinite(result.chi2) && result.chi2 >= 0.0, "chi2 is a number");
  requireCovariance(result.covariance);
}

} // namespace

int
LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
  constexpr std::array kModes{CovarianceMode::Exact,
                              CovarianceMode::GaussNewton,
                              CovarianceMode::SecondOrder,
                              CovarianceMode::Stagewise,
                              CovarianceMode::Auto};
  Bytes bytes(data, size);
  const CovarianceMode mode = kModes[bytes.take<std::uint8_t>() % kModes.size()];
  const FitOptions options = takeOptions(bytes);
  const std::vector<Point> points = takePoints(bytes);
  PointBatch batch;
  batch.clear(points.empty() ? Eigen::Vector3d::Zero() : points.back().place);
  for (const Point& point : points)
    batch.add(point.place, point.covariance);
  if (!validityError(options).empty()) {
    requireRefusal(batch, options, mode);
    return 0;
  }
  const FitResult result = estimatePatch(batch, options, mode);
  require(result.points + result.invalid_points + result.uninformative_points ==
              static_cast<int>(points.size()),
          "every point is used or counted as left out");
  if (isUsable(result.status))
    requireUsable(result);
  else
    require(result.covariance.size() == 0, "what is not usable has no covariance");
  return 0;
}
