// Sphere: k, c_x c_y c_z.
#pragma once

#include "model.h"

#include "geometry/safe_gap.h"

#include <cmath>

namespace holdfast { namespace models {

struct Sphere : ModelBase<kernel::Model::Sphere> {
  static constexpr int kFirstRotation = kShapeParameters;
  static constexpr bool kWraps = true;

  // f is linear in k, and c is no shape parameter.
  static void addCurvatureTerms(const UnboundedSurface&, const double[], ThetaMatrix&)
  {}

  static Eigen::Matrix3d translations(const UnboundedSurface&, const Scatter&)
  {
    return Eigen::Matrix3d::Identity();
  }

  static UnboundedSurface retracted(const UnboundedSurface& surface,
                                    const Scatter&,
                                    const Theta& step)
  {
    UnboundedSurface next =
        movedFrame(surface, Eigen::Vector3d::Zero(), step.segment<3>(1));
    next.k[0] += step[0];
    return next;
  }

  // The quadric's mean curvature; where the points wrap around, an algebraic fit
  // competes with it.
  static UnboundedSurface start(const StartRequest& request)
  {
    UnboundedSurface surface = quadricStart(kModel, request);
    surface.k = {0.5 * (surface.k[0] + surface.k[2]), 0.0, 0.0};
    if (!isThick(request.scatter))
      return surface;
    CheapestStart best(request, surface);
    const Eigen::Vector3d z = request.scatter.normal().normalized();
    if (const auto found = algebraicCentre(request, Eigen::Matrix3d::Identity()))
      best.consider(
          surfaceAround(kModel, *found, request.scatter.mean, z, frameFromZ(z).col(0)));
    return best.surface();
  }

  static double largestCurvature(const Eigen::Vector3d& k)
  {
    return std::abs(k[0]);
  }

  static Eigen::Matrix3d curvatureMatrix()
  {
    Eigen::Matrix3d shares = Eigen::Matrix3d::Zero();
    shares(0, 0) = shares(2, 0) = 1.0;
    return shares;
  }

  static Eigen::Vector3d curvatureShares()
  {
    return Eigen::Vector3d::UnitX();
  }

  static std::optional<SurfacePlacement> place(const PlacementRequest& request)
  {
    if (request.centre_on_normal_line)
      if (const auto placed = placeOnNormalLine(request))
        return placed;
    return placeApex(request);
  }

private:
  // The point of the sphere on the line of the normal through the centroid, and the
  // sphere's own normal there. It is where the points are, however little they know of
  // the centre: an apex along the normal from there slides with 1/k. None where the
  // line misses the sphere.
  static std::optional<SurfacePlacement> placeOnNormalLine(
      const PlacementRequest& request)
  {
    const UnboundedSurface& surface = request.surface;
    const NormalMap normal = normalMap(request);
    const double k = safeGap(surface.k[0], 1.0);
    const Eigen::Vector3d& n = normal.n;
    const Eigen::Vector3d mean =
        surface.R.transpose() * (request.scatter.mean - surface.c);
    // e: from the centre of the sphere to the mean; the line meets the sphere at
    // mean + s n, |e + s n| = 1/|k|, where its normal k (centre - c) is along n.
    const Eigen::Vector3d e = mean - Eigen::Vector3d::UnitZ() / k;
    const double along = e.dot(n);
    const double D = 1.0 / (k * k) - e.squaredNorm() + along * along;
    if (!(D > 0.0))
      return std::nullopt;
    const double root = std::copysign(std::sqrt(D), k);
    const double s = -along - root;
    JointRows3 dmean = JointRows3::Zero(), de;
    dmean.middleCols<3>(JointLayout::kMean).setIdentity();
    de = dmean;
    de.middleCols<3>(1) -= Eigen::Matrix3d::Identity();
    de(2, 0) += 1.0 / (k * k);
    const JointRow dalong = n.transpose() * de + e.transpose() * normal.dn;
    JointRow dD = 2.0 * along * dalong - 2.0 * e.transpose() * de;
    dD[0] -= 2.0 / (k * k * k);
    const JointRow ds = -dalong - dD / (2.0 * root);
    const Eigen::Vector3d c = mean + s * n, z = -k * (e + s * n);
    SurfacePlacement p{surface.R, surface.c + surface.R * c, surface.R * z};
    p.gamma = dmean + n * ds + s * normal.dn;
    JointRows3 dz = -k * (de + n * ds + s * normal.dn);
    dz.col(0) += z / k;
    // In the surface's axes: the rotation that moves z, about axes normal to it.
    p.delta = skew(z) * dz;
    return p;
  }

  // I-2 (ii), s = sphere: apex c = centre - n/k, centre = c_fit + z/k
  // (paper eq. (4) with the missing terms dc = dC + n dk/k^2 - dn/k).
  static std::optional<SurfacePlacement> placeApex(const PlacementRequest& request)
  {
    const UnboundedSurface& surface = request.surface;
    const NormalMap normal = normalMap(request);
    const double k = safeGap(surface.k[0], 1.0);
    const Eigen::Vector3d z = Eigen::Vector3d::UnitZ();
    SurfacePlacement p{surface.R,
                       surface.c + surface.R * (z - normal.n) / k,
                       surface.R * normal.n};
    p.gamma = normal.dn / -k;
    p.gamma.middleCols<3>(1) += Eigen::Matrix3d::Identity();
    p.gamma.col(0) += (normal.n - z) / (k * k);
    // In the surface's axes: the rotation that moves n, about axes normal to it.
    p.delta = skew(normal.n) * normal.dn;
    return p;
  }
};

}} // namespace holdfast::models
