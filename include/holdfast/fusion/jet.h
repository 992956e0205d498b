/// \file A surface at a place: height, gradient and curvature, with covariance.
///
/// Patches cannot be fused as [d | k | r | c]: the centre slides with the points that
/// were seen, axes jump where curvatures are equal, bounds describe the sample. What
/// two views of a spot have in common is the unbounded surface there, and its 2-jet at
/// a fixed frame, the anchor, has six numbers, no gauge and no singularity.
#pragma once

#include <holdfast/fit/result.h>
#include <holdfast/geometry/pose.h>

#include <Eigen/Core>

#include <optional>

namespace holdfast {

using JetVector = Eigen::Matrix<double, 6, 1>;
using JetMatrix = Eigen::Matrix<double, 6, 6>;

/// The surface z = h(x, y) over the xy plane of an anchor, at its origin, to second
/// order.
struct Jet {
  /// [h | gx gy | kxx kxy kyy]: height, m, gradient and Hessian, 1/m.
  JetVector value = JetVector::Zero();
  /// Covariance that errors of single points make: it averages over views.
  JetMatrix white = JetMatrix::Zero();
  /// Covariance that errors which pixels share make: it averages only over views that
  /// see the spot through other pixels. Zero where nobody tells the two apart.
  JetMatrix pattern = JetMatrix::Zero();

  JetMatrix covariance() const
  {
    return white + pattern;
  }

  /// h(x, y) to second order, m.
  double height(double x, double y) const;
};

/// d height(x, y) / d value: 1, x, y, x^2/2, xy, y^2/2.
JetVector jetBasis(double x, double y);

/// d jet / d[xxx xxy xyy yyy] of what a fit of a quadric makes of third derivatives at
/// its anchor; zero where the quadric is that of the derivatives themselves
/// (holdfast/fusion/roughness.h).
using ThirdToJet = Eigen::Matrix<double, 6, 4>;

/// The frame in which the surface of a fit has the jet [0 | 0 0 | k]: origin at its
/// centre, z its normal, x as frameFromZ() chooses it.
Pose ownAnchor(const FitResult& fit);

/// The jet of the surface of a fit at an anchor in the frame of the fit, with its
/// covariance to first order; the part of the pattern apart where the fit has it apart
/// (FitOptions::separate_pattern), else all is white. The surface is the paraboloid of
/// its state: a sphere or cylinder counts as the one that osculates it at its centre, a
/// plane claims a curvature of exactly zero. What is fused should be fitted as
/// SurfaceRequest::Paraboloid, since the choice of a type is in no covariance.
/// \param by_third the jet is that of the quadric about the anchor's axis which fits
///        the surface best in the sense of a fit: a paraboloid about another axis is
///        none about this one, and has third derivatives there.
/// \return nothing where the fit is not usable, or the anchor's z axis misses the
/// surface or meets it at more than 84 degrees from its normal.
std::optional<Jet> jetAt(const FitResult& fit,
                         const Pose& anchor,
                         const ThirdToJet& by_third = ThirdToJet::Zero());

/// A jet and how it moves with what it was made from.
struct MovedJet {
  JetVector value;
  JetMatrix by_jet; ///< d value / d(jet it was made from)
  /// d value / d(phi, t), `to` in the frame of `from` perturbed as R <- R Exp(phi),
  /// t <- t + dt: rad and m.
  JetMatrix by_pose;
};

/// The surface z = h(x, y) of a jet as another frame has it, exactly and not only to
/// second order in the step; `to` is given in the frame of the jet.
/// \param by_third as jetAt(), about `to`, of the fit that the jet came from. What that
///        fit left out of the surface is none of a quadric about either axis, so that
///        the best quadric of the fit is that of the surface itself.
/// \return nothing where jetAt() returns nothing.
std::optional<MovedJet> movedJet(const JetVector& jet,
                                 const Pose& to,
                                 const ThirdToJet& by_third = ThirdToJet::Zero());

/// The same from one anchor to another, both in the same frame, with covariances.
std::optional<Jet> transported(const Jet& jet,
                               const Pose& from,
                               const Pose& to,
                               const ThirdToJet& by_third = ThirdToJet::Zero());

/// d jet / d(omega, t) of a surface that moves while its anchor stays, every point p of
/// the anchor's frame by omega x (p - pivot) + t: how an error of the sensor's pose
/// shows.
JetMatrix jetByMotion(const JetVector& jet, const Eigen::Vector3d& pivot);

} // namespace holdfast
