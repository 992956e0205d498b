// Plane: delta_x delta_y, c_z.
#pragma once

#include "model.h"

namespace holdfast { namespace models {

struct Plane : ModelBase<kernel::Model::Plane> {
  static constexpr int kFirstRotation = 0;
  static constexpr bool kWraps = false;

  static void addCurvatureTerms(const UnboundedSurface&,
                                const double L[],
                                ThetaMatrix& H)
  {
    H(0, 0) += 2.0 * L[kernel::PZ];
    H(1, 1) += 2.0 * L[kernel::PZ];
  }

  static Eigen::Matrix3d translations(const UnboundedSurface&, const Scatter&)
  {
    Eigen::Matrix3d directions = Eigen::Matrix3d::Identity();
    directions.col(0) = Eigen::Vector3d::UnitZ();
    return directions;
  }

  static UnboundedSurface retracted(const UnboundedSurface& surface,
                                    const Scatter&,
                                    const Theta& step)
  {
    return movedFrame(surface, {step[0], step[1], 0.0}, {0.0, 0.0, step[2]});
  }

  static UnboundedSurface start(const StartRequest& request)
  {
    UnboundedSurface surface;
    surface.model = kModel;
    surface.R = request.scatter.axes;
    surface.c = request.scatter.mean;
    return surface;
  }

  static double largestCurvature(const Eigen::Vector3d&)
  {
    return 0.0;
  }

  static Eigen::Matrix3d curvatureMatrix()
  {
    return Eigen::Matrix3d::Zero();
  }

  static Eigen::Vector3d curvatureShares()
  {
    return Eigen::Vector3d::Zero();
  }

  static std::optional<SurfacePlacement> place(const PlacementRequest& request)
  {
    const UnboundedSurface& surface = request.surface;
    SurfacePlacement p{surface.R, surface.c, surface.R.col(2)};
    p.delta(0, 0) = p.delta(1, 1) = 1.0;
    p.gamma(2, 2) = 1.0;
    return p;
  }
};

}} // namespace holdfast::models
