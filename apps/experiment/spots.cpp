#include "spots.h"

#include "scene.h"

#include <holdfast/fusion/roughness.h>
#include <holdfast/geometry/constants.h>
#include <holdfast/simulation/reference_scenes.h>
#include <holdfast/simulation/relief.h>
#include <holdfast/simulation/simulator.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>

#include <boost/math/distributions/chi_squared.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>

namespace holdfast::app {

Sensor
independentKinect()
{
  Sensor sensor;
  sensor.name = "kinect";
  sensor.camera = referenceCamera();
  sensor.noise = kinectNoise();
  return sensor;
}

double
uniformBetween(double low, double high, std::mt19937_64& generator)
{
  return low + (high - low) * std::generate_canonical<double, 53>(generator);
}

Eigen::Vector3d
normalVector(std::mt19937_64& generator)
{
  std::normal_distribution<double> normal;
  Eigen::Vector3d v;
  for (double& component : v)
    component = normal(generator);
  return v;
}

Scene
curvedSpot(double s3_per_m2, std::mt19937_64& generator)
{
  constexpr double kRadius = 0.12; // all that a view of 5 cm may reach
  const Eigen::Vector3d second(-5.0, 0.0, -10.0);
  std::normal_distribution<double> normal;
  Eigen::Vector4d n;
  for (double& component : n)
    component = normal(generator);
  const Eigen::LLT<Eigen::Matrix4d> root(unitThirdDerivatives());
  const Eigen::Vector4d unit = root.matrixL() * n;
  const Eigen::Vector4d third = s3_per_m2 * unit;
  Scene scene;
  scene.shapes.push_back(std::make_shared<Relief>(Pose(), second, third, kRadius));
  return scene;
}

Pose
viewOfSpot(std::mt19937_64& generator)
{
  const double distance = uniformBetween(0.8, 1.2, generator);
  const double tilt = uniformBetween(0.2, 0.8, generator);
  const double azimuth = uniformBetween(0.0, 2.0 * kPi, generator);
  const Eigen::Vector3d direction(std::sin(tilt) * std::cos(azimuth),
                                  std::sin(tilt) * std::sin(azimuth),
                                  std::cos(tilt));
  Eigen::Vector3d target;
  for (double& component : target)
    component = uniformBetween(-0.1, 0.1, generator);
  return lookAt(distance * direction, target, normalVector(generator));
}

Pose
discNearSpot(double offset_m, std::mt19937_64& generator)
{
  const double angle = uniformBetween(0.0, 2.0 * kPi, generator);
  const double length = offset_m * std::sqrt(uniformBetween(0.0, 1.0, generator));
  Pose disc;
  disc.c = length * Eigen::Vector3d(std::cos(angle), std::sin(angle), 0.0);
  return disc;
}

FitOptions
fusedFitOptions()
{
  FitOptions options;
  options.surface = SurfaceRequest::Paraboloid;
  options.separate_pattern = true;
  return options;
}

double
squaredInSigmas(const Eigen::VectorXd& error, const Eigen::MatrixXd& covariance)
{
  const Eigen::VectorXd scale = covariance.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd scaled = scale.asDiagonal() * covariance * scale.asDiagonal();
  const Eigen::VectorXd e = scale.cwiseProduct(error);
  return e.dot(scaled.llt().solve(e));
}

ObservedError
observedError(const JetVector& error, const RegistrationResult& result)
{
  // The covariance has rank 6 - k; the error is a sum of its range and null space,
  // which are oblique.
  const Eigen::Index k = result.null_space.cols();
  JetVector scale = JetVector::Ones();
  for (int i = 0; i < 6; ++i)
    if (result.covariance(i, i) > 0.0)
      scale[i] = 1.0 / std::sqrt(result.covariance(i, i));
  const JetMatrix scaled = scale.asDiagonal() * result.covariance * scale.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<JetMatrix> solver(scaled); // ascending
  JetMatrix basis = solver.eigenvectors();
  basis.leftCols(k) = scale.asDiagonal() * result.null_space;
  JetVector parts = basis.partialPivLu().solve(scale.cwiseProduct(error));
  parts.head(k).setZero();
  ObservedError observed;
  observed.dof = static_cast<int>(6 - k);
  observed.squared_in_sigmas = parts.tail(6 - k)
                                   .cwiseAbs2()
                                   .cwiseQuotient(solver.eigenvalues().tail(6 - k))
                                   .sum();
  observed.error = (basis * parts).cwiseQuotient(scale);
  return observed;
}

void
Mean::add(double value)
{
  sum_ += value;
  squares_ += value * value;
  ++count_;
}

Json
Mean::value() const
{
  return count_ > 0 ? Json(sum_ / count_) : Json();
}

Json
Mean::root() const
{
  return count_ > 0 ? Json(std::sqrt(sum_ / count_)) : Json();
}

Json
Mean::standardError() const
{
  if (count_ < 2)
    return {};
  const double mean = sum_ / count_;
  const double variance = squares_ / count_ - mean * mean;
  return std::sqrt(std::max(0.0, variance) / (count_ - 1));
}

void
ErrorComparison::add(double squared_in_sigmas, int dof)
{
  // 95 % of chi-square of 1 to 6.
  static const std::array<double, 6> limits = [] {
    std::array<double, 6> values{};
    for (std::size_t i = 0; i < values.size(); ++i)
      values[i] =
          boost::math::quantile(boost::math::chi_squared(static_cast<double>(i + 1)),
                                0.95);
    return values;
  }();
  nees_.add(squared_in_sigmas / dof);
  const double limit = limits.at(static_cast<std::size_t>(dof - 1));
  inside_.add(squared_in_sigmas <= limit ? 1.0 : 0.0);
}

void
ErrorComparison::addTo(Json& row, const std::string& prefix) const
{
  row[prefix + "nees_per_dof"] = nees_.value();
  row[prefix + "nees_standard_error"] = nees_.standardError();
  row[prefix + "coverage95"] = inside_.value();
}

} // namespace holdfast::app
