// Sphere: k, c_x c_y c_z.
#pragma once

#include "model.h"

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

  static Eigen::Vector3d curvatureShares()
  {
    return Eigen::Vector3d::UnitX();
  }

  // I-2 (ii), s = sphere: apex c = centre - n/k, centre = c_fit + z/k
  // (paper eq. (4) with the missing terms dc = dC + n dk/k^2 - dn/k).
  static std::optional<Placement> place(const PlacementRequest& request)
  {
    const UnboundedSurface& surface = request.surface;
    const NormalMap normal = normalMap(request);
    const double k = safeGap(surface.k[0], 1.0);
    const Eigen::Vector3d z = Eigen::Vector3d::UnitZ();
    Placement p{surface.R,
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
