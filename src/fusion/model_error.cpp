// What third derivatives do to a jet: of roughness.h all that needs no fit, so that a
// map is written without what makes one.
#include <holdfast/fusion/roughness.h>

namespace holdfast {

const Eigen::Matrix4d&
unitThirdDerivatives()
{
  // clang-format off
  static const Eigen::Matrix4d S = (Eigen::Matrix4d() <<
      1.0, 0.0, 0.2, 0.0,
      0.0, 0.2, 0.0, 0.2,
      0.2, 0.0, 0.2, 0.0,
      0.0, 0.2, 0.0, 1.0).finished();
  // clang-format on
  return S;
}

ThirdToJet
thirdToJetOfDisc(double radius_m)
{
  // A cubic term goes into a slope as far as it correlates with it over the disc:
  // E[x^4]/6 E[x^2] = E[x^2 y^2]/2 E[y^2] = radius^2/12.
  const double a = radius_m * radius_m / 12.0;
  ThirdToJet B = ThirdToJet::Zero();
  B(1, 0) = B(1, 2) = B(2, 1) = B(2, 3) = a;
  return B;
}

JetMatrix
modelError(const ThirdToJet& one, const ThirdToJet& other, double s3_per_m2)
{
  const ThirdToJet B = one - other;
  return s3_per_m2 * s3_per_m2 * (B * unitThirdDerivatives() * B.transpose());
}

} // namespace holdfast
