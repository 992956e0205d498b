#include "sac_minimal_solvers.h"

#include <holdfast/geometry/constants.h>
#include <holdfast/geometry/rotation.h>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <Eigen/SVD>

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <limits>

namespace holdfast {
namespace {

using Vector5d = Eigen::Matrix<double, 5, 1>;

// A sample about its mean, in units of the largest distance from it.
struct NormalizedSample {
  Eigen::Vector3d mean;
  double scale;
  // How thick points are that single-precision coordinates spread about a line or a
  // plane: some roundings of the largest coordinate.
  double thickness;
  Sample q;

  Eigen::Vector3d toWorld(const Eigen::Vector3d& point) const
  {
    return mean + scale * point;
  }
};

std::optional<NormalizedSample>
normalized(const Sample& sample)
{
  constexpr double kRoundings = 10.0;
  NormalizedSample result{Eigen::Vector3d::Zero(), 0.0, 0.0, sample};
  double largest = 0.0;
  for (const Eigen::Vector3d& point : sample) {
    result.mean += point / static_cast<double>(sample.size());
    largest = std::max(largest, point.lpNorm<Eigen::Infinity>());
  }
  for (Eigen::Vector3d& q : result.q) {
    q -= result.mean;
    result.scale = std::max(result.scale, q.norm());
  }
  const double rounding = kRoundings * std::numeric_limits<float>::epsilon() * largest;
  if (!(result.scale > rounding) || !std::isfinite(result.scale))
    return std::nullopt;
  for (Eigen::Vector3d& q : result.q)
    q /= result.scale;
  result.thickness = rounding / result.scale;
  return result;
}

bool
isRadius(double radius_m)
{
  return radius_m > 0.0 && std::isfinite(radius_m);
}

// The cylinders through five points. Seen along the axis a they lie on a circle, with
// P = I - a a^T:
//
//     |P q_i|^2 - 2 c^T P q_i = const,   v_i(a) := |P q_i|^2 = |q_i|^2 - (a^T q_i)^2.
//
// The affine dependency of the points, sum l_i q_i = 0 and sum l_i = 0, leaves of this
// sum l_i v_i(a) = 0, a cone of axes a. On it the equations determine c = M v(a) but
// for its part along a, and a^T c = 0, where c is taken from the plain q_i, is a cubic
// form. With the cone as a circle, a = B [cos t, sin t, 1], the cubic becomes a
// trigonometric polynomial with up to six zeros t.
class FivePointCylinders {
public:
  static constexpr int kPoints = 5;

  explicit FivePointCylinders(const NormalizedSample& sample)
  {
    Eigen::Matrix<double, kPoints, 4> rows;
    for (int i = 0; i < kPoints; ++i) {
      q_.col(i) = sample.q[static_cast<std::size_t>(i)];
      rows.row(i) << 2.0 * q_.col(i).transpose(), 1.0;
    }
    const Eigen::JacobiSVD<Eigen::MatrixXd> svd(rows,
                                                Eigen::ComputeFullU |
                                                    Eigen::ComputeThinV);
    if (!(svd.singularValues()[3] > sample.thickness))
      return; // in a plane
    M_ = svd.solve(Eigen::Matrix<double, 5, 5>::Identity()).topRows<3>();
    determined_ = setCone(svd.matrixU().col(4), sample.thickness);
  }

  /// Calls use(axis, centre), both in the sample's units, for every real cylinder.
  template <typename Use>
  void forEach(Use&& use) const
  {
    if (!determined_)
      return;
    for (const double t : zeros()) {
      const Eigen::Vector3d a = axis(t).normalized();
      const Eigen::Vector3d c = M_ * squaredDistances(a);
      use(a, Eigen::Vector3d(c - a * a.dot(c)));
    }
  }

private:
  static constexpr int kDegree = 3; // of the trigonometric polynomial
  using Coefficients = std::array<std::complex<double>, kDegree + 1>;

  // From sum l_i (|q_i|^2 I - q_i q_i^T). False where no axis is real.
  bool setCone(const Vector5d& dependency, double thickness)
  {
    Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
    for (int i = 0; i < kPoints; ++i)
      A += dependency[i] * (q_.col(i).squaredNorm() * Eigen::Matrix3d::Identity() -
                            q_.col(i) * q_.col(i).transpose());
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(A);
    const Eigen::Vector3d l = solver.eigenvalues();
    // The axis of the cone is the direction whose sign the other two do not share.
    const int lone = l[1] > 0.0 ? 0 : 2;
    // All of it is rounding where two of the points are one.
    const bool exists = l.cwiseAbs().maxCoeff() > thickness;
    if (!exists || !(l[0] * l[2] < 0.0) || l[1] == 0.0)
      return false;
    for (int column = 0, from = 0; from < 3; ++from)
      B_.col(from == lone ? 2 : column++) =
          solver.eigenvectors().col(from) / std::sqrt(std::abs(l[from]));
    return true;
  }

  Eigen::Vector3d axis(double t) const
  {
    return B_ * Eigen::Vector3d(std::cos(t), std::sin(t), 1.0);
  }

  // v(a) for an axis of any length, homogeneous of degree two.
  Vector5d squaredDistances(const Eigen::Vector3d& a) const
  {
    return a.squaredNorm() * q_.colwise().squaredNorm().transpose() -
           (q_.transpose() * a).cwiseAbs2();
  }

  double cubic(double t) const
  {
    const Eigen::Vector3d a = axis(t);
    return a.dot(M_ * squaredDistances(a));
  }

  // F_m, m = 0..3, of cubic(t) = sum over m = -3..3 of F_m e^(i m t), F_-m = conj F_m.
  Coefficients fourierCoefficients() const
  {
    constexpr int kSamples = 2 * kDegree + 1;
    Coefficients F{};
    for (int j = 0; j < kSamples; ++j) {
      const double t = 2.0 * kPi * j / kSamples;
      for (int m = 0; m <= kDegree; ++m)
        F[static_cast<std::size_t>(m)] += std::polar(cubic(t) / kSamples, -m * t);
    }
    return F;
  }

  // The zeros e^(it) on the unit circle of sum F_m z^(m + 3): eigenvalues of its
  // companion matrix.
  std::vector<double> zeros() const
  {
    // A double zero is split by the root of rounding.
    constexpr double kOnCircle = 1e-4;
    constexpr int n = 2 * kDegree;
    const Coefficients F = fourierCoefficients();
    Eigen::Matrix<std::complex<double>, n, n> companion;
    companion.setZero();
    for (int i = 0; i < n; ++i) {
      const std::complex<double> f = i < kDegree ?
                                         std::conj(F[std::size_t(kDegree - i)]) :
                                         F[std::size_t(i - kDegree)];
      companion(i, n - 1) = -f / F[kDegree];
      if (i > 0)
        companion(i, i - 1) = 1.0;
    }
    std::vector<double> result;
    if (!companion.allFinite())
      return result;
    const Eigen::ComplexEigenSolver<decltype(companion)> solver(companion, false);
    for (const std::complex<double>& z : solver.eigenvalues())
      if (std::abs(std::abs(z) - 1.0) < kOnCircle)
        result.push_back(polished(F, std::arg(z)));
    return result;
  }

  // One Newton step, which squares what error the eigenvalues have.
  static double polished(const Coefficients& F, double t)
  {
    double value = F[0].real(), slope = 0.0;
    for (int m = 1; m <= kDegree; ++m) {
      const std::complex<double> term =
          2.0 * F[static_cast<std::size_t>(m)] * std::polar(1.0, m * t);
      value += term.real();
      slope -= m * term.imag();
    }
    const double step = value / slope;
    return std::abs(step) < 1e-3 ? t - step : t; // no slope at a double zero
  }

  Eigen::Matrix<double, 3, kPoints> q_;
  Eigen::Matrix<double, 3, kPoints> M_;
  Eigen::Matrix3d B_;
  bool determined_ = false;
};

} // namespace

std::optional<Patch>
planePatch(const Eigen::Vector3d& normal, const Eigen::Vector3d& point)
{
  const double length = normal.norm();
  if (!isRadius(length) || !point.allFinite())
    return std::nullopt;
  Patch patch;
  patch.r.head<2>() = rxyFromNormal(normal / length);
  patch.c = point;
  return patch;
}

std::optional<Patch>
spherePatch(const Eigen::Vector3d& centre, double radius_m)
{
  if (!isRadius(radius_m) || !centre.allFinite())
    return std::nullopt;
  Patch patch;
  patch.type = {SurfaceType::Sphere, BoundaryType::Circle};
  patch.kappa[0] = -1.0 / radius_m;
  patch.c = centre + radius_m * Eigen::Vector3d::UnitZ();
  return patch;
}

std::optional<Patch>
cylinderPatch(const Eigen::Vector3d& point,
              const Eigen::Vector3d& axis,
              double radius_m)
{
  const double length = axis.norm();
  if (!isRadius(radius_m) || !isRadius(length) || !point.allFinite())
    return std::nullopt;
  const Eigen::Matrix3d about = frameFromZ(axis / length);
  Eigen::Matrix3d R;
  R << about.col(2), about.col(0), about.col(1);
  Patch patch;
  patch.type = {SurfaceType::CircularCylinder, BoundaryType::Rectangle};
  patch.kappa[0] = -1.0 / radius_m;
  patch.r = logMap(R);
  patch.c = point + radius_m * R.col(2);
  return patch;
}

std::optional<Patch>
planeThrough(const Sample& sample)
{
  const auto points = normalized(sample);
  if (!points)
    return std::nullopt;
  const Sample& q = points->q;
  const Eigen::Vector3d normal = (q[1] - q[0]).cross(q[2] - q[0]);
  if (!(normal.norm() > points->thickness))
    return std::nullopt;
  return planePatch(normal, points->mean);
}

std::optional<Patch>
sphereThrough(const Sample& sample)
{
  const auto points = normalized(sample);
  if (!points)
    return std::nullopt;
  // |q_i - c| = |q_0 - c|.
  const Sample& q = points->q;
  Eigen::Matrix3d A;
  Eigen::Vector3d b;
  for (int i = 0; i < 3; ++i) {
    A.row(i) = 2.0 * (q[std::size_t(i) + 1] - q[0]);
    b[i] = q[std::size_t(i) + 1].squaredNorm() - q[0].squaredNorm();
  }
  const Eigen::FullPivLU<Eigen::Matrix3d> lu(A);
  if (!(std::abs(lu.matrixLU()(2, 2)) > points->thickness))
    return std::nullopt;
  const Eigen::Vector3d centre = lu.solve(b);
  return spherePatch(points->toWorld(centre), points->scale * (q[0] - centre).norm());
}

std::optional<Patch>
cylinderThrough(const Sample& sample)
{
  const auto points = normalized(sample);
  if (!points)
    return std::nullopt;
  std::optional<Patch> best;
  double smallest = std::numeric_limits<double>::infinity();
  FivePointCylinders(*points).forEach([&](const auto& axis, const auto& centre) {
    const auto fromAxis = [&](const Eigen::Vector3d& q) {
      return (q - centre).cross(axis).norm();
    };
    const double radius = fromAxis(points->q.front());
    const double error = std::abs(fromAxis(points->q.back()) - radius);
    if (!(error < smallest))
      return;
    smallest = error;
    best = cylinderPatch(points->toWorld(centre), axis, points->scale * radius);
  });
  return best;
}

std::optional<Patch>
paraboloidThrough(const Sample& sample,
                  const Eigen::Vector3d& viewpoint,
                  const PatchFitter& fitter)
{
  const auto points = normalized(sample);
  if (!points)
    return std::nullopt;
  // Any noise will do for a fit without residuals; its sigmas are the unit in which the
  // fit measures its convergence.
  const double sigma = 1e-3 * points->scale;
  PointBatch batch;
  batch.clear(points->mean, viewpoint);
  for (const Eigen::Vector3d& point : sample)
    batch.add(point, sigma * sigma * Eigen::Matrix3d::Identity());
  const PatchFit fit = fitter.fit(batch);
  // Half the squared residuals: in a false minimum the fit misses some of the points.
  constexpr double kNone = 1e-6;
  if (fit.status != FitStatus::Converged || !(fit.surface.cost < kNone))
    return std::nullopt;
  return fit.bounded.patch;
}

} // namespace holdfast
