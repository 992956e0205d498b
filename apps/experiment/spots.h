/// \file Spots of simulated surfaces before a Kinect, and how errors of jets compare
/// with their covariances.
#pragma once

#include "report.h"

#include <holdfast/fit/options.h>
#include <holdfast/fusion/registration.h>
#include <holdfast/sensor/sensor.h>
#include <holdfast/simulation/scene.h>

#include <Eigen/Core>

#include <random>

namespace holdfast::app {

/// The paper's Kinect, its errors independent.
Sensor independentKinect();

/// Uniform in [low, high).
double uniformBetween(double low, double high, std::mt19937_64& generator);

/// Three independent numbers of standard deviation one.
Eigen::Vector3d normalVector(std::mt19937_64& generator);

/// z = (-5 x^2 - 10 y^2)/2, m, at the origin, z up, and third derivatives of an
/// isotropic random field (fusion/roughness.h).
/// \param s3_per_m2 their root mean square.
Scene curvedSpot(double s3_per_m2, std::mt19937_64& generator);

/// Of a camera 0.8 to 1.2 m from the origin, 0.2 to 0.8 rad from above, at any azimuth
/// and any turn of its image, that sees the origin somewhere about its middle.
Pose viewOfSpot(std::mt19937_64& generator);

/// A level disc whose centre is up to offset_m from the origin.
Pose discNearSpot(double offset_m, std::mt19937_64& generator);

/// What is fused: paraboloids, with the pattern apart.
FitOptions fusedFitOptions();

/// error^T covariance^-1 error, whatever the units of its numbers.
double squaredInSigmas(const Eigen::VectorXd& error, const Eigen::MatrixXd& covariance);

/// The part of a pose's error that registration speaks of.
struct ObservedError {
  JetVector error; ///< of (delta, c), without what lies along its null space
  double squared_in_sigmas = 0.0;
  int dof = 0;
};
ObservedError observedError(const JetVector& error, const RegistrationResult& result);

/// Mean of one number over trials.
class Mean {
public:
  void add(double value);
  int count() const
  {
    return count_;
  }
  Json value() const; ///< null without trials
  Json root() const; ///< of the mean: what squares are added for
  Json standardError() const;

private:
  double sum_ = 0.0, squares_ = 0.0;
  int count_ = 0;
};

/// How errors compare with the covariances that came with them.
class ErrorComparison {
public:
  /// \param dof in 1 to 6: how many numbers there are
  void add(double squared_in_sigmas, int dof);
  int count() const
  {
    return nees_.count();
  }
  /// Adds PREFIXnees_per_dof, PREFIXnees_standard_error and PREFIXcoverage95.
  void addTo(Json& row, const std::string& prefix = "") const;
  Json neesPerDof() const
  {
    return nees_.value();
  }

private:
  Mean nees_, inside_;
};

} // namespace holdfast::app
