/// \file Where the rays around a seed meet the surface that it lies on.
///
/// 1/z as a polynomial of second order in the ray's slopes x/z and y/z. Planes are of
/// first order in it, exactly, and the errors of disparity sensors are the same all
/// over, so that plain least squares fit it without bias. What is chosen by where rays
/// meet it is not chosen by the noise along them.
#pragma once

#include <Eigen/Core>

#include <array>

namespace holdfast {

/// Measured points: the slopes of their rays from those of the seed's ray, and 1/z,
/// 1/m.
struct RaySamples {
  /// More hardly improve the surface, whose errors count only by the slope.
  static constexpr int kMost = 96;

  int size = 0;
  double s[kMost], t[kMost], inverse_depth[kMost];

  void add(double s_of_ray, double t_of_ray, double one_over_z)
  {
    s[size] = s_of_ray, t[size] = t_of_ray, inverse_depth[size] = one_over_z;
    ++size;
  }
};

class ReferenceSurface {
public:
  /// What faces the camera at the depth of the seed.
  /// \param ray x/z and y/z of the seed
  ReferenceSurface(const Eigen::Vector2d& ray, double depth_m);

  /// Least squares: a plane. \return false, and nothing changed, where the points do
  /// not tell one.
  bool fitPlane(const RaySamples& samples);

  /// A quadric where the samples tell that the surface is no plane, else a plane: what
  /// they do not tell would make the choice of points follow the noise.
  /// \param sigma of 1/z, 1/m. \return as fitPlane().
  bool fitQuadric(const RaySamples& samples, double sigma);

  /// 1/z along a ray.
  double inverseDepth(double s, double t) const
  {
    return h_[0] + s * (h_[1] + h_[4] * t + h_[3] * s) + t * (h_[2] + h_[5] * t);
  }

  /// Coefficients of 1, s, t, s^2, s t, t^2.
  const std::array<double, 6>& coefficients() const
  {
    return h_;
  }

  bool isPlane() const
  {
    return h_[3] == 0.0 && h_[4] == 0.0 && h_[5] == 0.0;
  }

  const Eigen::Vector2d& seedRay() const
  {
    return ray_;
  }

  /// Where the seed's ray meets it, camera frame, m.
  Eigen::Vector3d point() const;

  /// Unit normal there, on either side.
  Eigen::Vector3d normal() const;

private:
  bool take(const std::array<double, 6>& h);

  Eigen::Vector2d ray_;
  std::array<double, 6> h_{};
};

/// Squared distance along the tangent plane from a point of it, less a squared radius,
/// times rho^2, of the point at z = 1 / rho of the ray (x, y, 1).
struct LateralExcess {
  std::array<double, 3> point, normal;
  double squared_radius;

  double operator()(double x, double y, double rho) const
  {
    // rho (P - P0).
    const double gx = x - rho * point[0], gy = y - rho * point[1];
    const double gz = 1.0 - rho * point[2];
    const double off = normal[0] * gx + normal[1] * gy + normal[2] * gz;
    return gx * gx + gy * gy + gz * gz - off * off - squared_radius * rho * rho;
  }
};

/// Tells whether a ray meets the surface within a distance from where the seed's does,
/// measured along the tangent plane there.
class LateralDisc {
public:
  LateralDisc(const ReferenceSurface& surface, double radius_m);

  bool contains(double s, double t) const
  {
    const double rho = surface_.inverseDepth(s, t);
    return excess(s, t, rho) <= 0.0;
  }

  /// Squared distance less squared radius, times rho^2, of the ray's point at 1/z =
  /// rho.
  double excess(double s, double t, double rho) const
  {
    return excess_(surface_.seedRay().x() + s, surface_.seedRay().y() + t, rho);
  }

  /// Of the squared distance along the tangent plane, less the squared radius, times
  /// 1/z^2: A s^2 + 2 (B . (1, t)) s + C . (1, t, t^2). Its roots bound the rays that
  /// meet the tangent plane within the radius, and where the surface is a plane no
  /// others are within it; with A not positive, the plane is seen edge-on.
  struct OnTangentPlane {
    double A;
    std::array<double, 2> B;
    std::array<double, 3> C;
  };

  const OnTangentPlane& onTangentPlane() const
  {
    return on_tangent_plane_;
  }

  const ReferenceSurface& surface() const
  {
    return surface_;
  }

  const LateralExcess& lateralExcess() const
  {
    return excess_;
  }

private:
  ReferenceSurface surface_;
  LateralExcess excess_;
  OnTangentPlane on_tangent_plane_;
};

} // namespace holdfast
