/// \file What of a surface is no quadric, and what that does to fits of quadrics.
///
/// The third derivatives of a surface are taken as an isotropic random field with root
/// mean square s3 (1/m^2): in the order xxx xxy xyy yyy their covariance is
/// s3^2 [1 0 .2 0; 0 .2 0 .2; .2 0 .2 0; 0 .2 0 1].
#pragma once

#include <holdfast/fit/point_batch.h>
#include <holdfast/fusion/jet.h>

#include <Eigen/Core>

namespace holdfast {

/// Covariance of [xxx xxy xyy yyy] for s3 = 1.
const Eigen::Matrix4d& unitThirdDerivatives();

/// Of the best quadric, in least squares, over a disc about the anchor's origin that is
/// filled evenly.
ThirdToJet thirdToJetOfDisc(double radius_m);

/// What of a fit depends on where its points are and how much each counts.
struct FitDesign {
  ThirdToJet by_third = ThirdToJet::Zero(); ///< at the anchor of the fit
  /// tr(S3 sum r r^T / sigma^2) with S3 for s3 = 1 and r what the quadric leaves of the
  /// cubic terms at each point, m^4: by this much times s3^2 chi-square is larger than
  /// on a quadric.
  double chi2_per_roughness = 0.0;
};

/// Of a weighted fit to the points of a batch.
/// \param anchor of the patch, frame of the points.
FitDesign designOf(const PointBatch& batch, const Pose& anchor);

/// The same fit as another anchor has it.
/// \param pose of the fit's own anchor in that other one; how the two are tilted to
///        each other does not count.
ThirdToJet movedThirdToJet(const ThirdToJet& own, const Pose& pose);

/// By how much the best quadric of one fit differs, as a covariance of jets at the
/// anchor, from that of another: zero where both see alike.
/// \param s3_per_m2 root mean square third derivative.
JetMatrix modelError(const ThirdToJet& one, const ThirdToJet& other, double s3_per_m2);

} // namespace holdfast
