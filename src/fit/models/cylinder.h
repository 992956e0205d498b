// Circular cylinder about local x: k, delta_y delta_z, c_y c_z.
#pragma once

#include "model.h"

#include "geometry/safe_gap.h"
#include "geometry/symmetric.h"

#include <Eigen/Geometry>

#include <cmath>

namespace holdfast { namespace models {

struct Cylinder : ModelBase<kernel::Model::Cylinder> {
  static constexpr int kFirstRotation = 1;
  static constexpr bool kWraps = true;

  static void addCurvatureTerms(const UnboundedSurface& surface,
                                const double L[],
                                ThetaMatrix& H)
  {
    using namespace kernel;
    const double k = surface.k[0];
    H(0, 1) += 2.0 * L[PXZ];
    H(0, 2) -= 2.0 * L[PXY];
    H(1, 1) += 2.0 * (k * (L[PXX] - L[PZZ]) + L[PZ]);
    H(2, 2) += 2.0 * k * (L[PXX] - L[PYY]);
    H(1, 2) += 2.0 * k * L[PYZ] - L[PY];
  }

  static Eigen::Matrix3d translations(const UnboundedSurface&, const Scatter&)
  {
    Eigen::Matrix3d directions;
    directions << 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0;
    return directions;
  }

  static UnboundedSurface retracted(const UnboundedSurface& surface,
                                    const Scatter&,
                                    const Theta& step)
  {
    UnboundedSurface next =
        movedFrame(surface, {0.0, step[1], step[2]}, {0.0, step[3], step[4]});
    next.k[0] += step[0];
    return next;
  }

  // The quadric's stronger curvature; where the points wrap around, algebraic fits
  // about both axes of the scatter compete with it.
  static UnboundedSurface start(const StartRequest& request)
  {
    UnboundedSurface surface = quadricStart(kModel, request);
    align(surface);
    if (!isThick(request.scatter))
      return surface;
    CheapestStart best(request, surface);
    // An axis along the normal would leave no direction for z.
    for (int i = 0; i < 2; ++i) {
      const Eigen::Vector3d axis = request.scatter.axes.col(i);
      const Eigen::Matrix3d projector =
          Eigen::Matrix3d::Identity() - axis * axis.transpose();
      Eigen::Vector3d z = request.scatter.normal();
      z -= axis * axis.dot(z);
      z.normalize();
      if (const auto found = algebraicCentre(request, projector))
        best.consider(surfaceAround(kModel, *found, request.scatter.mean, z, axis));
    }
    return best.surface();
  }

  static double largestCurvature(const Eigen::Vector3d& k)
  {
    return std::abs(k[0]);
  }

  static Eigen::Matrix3d curvatureMatrix()
  {
    Eigen::Matrix3d shares = Eigen::Matrix3d::Zero();
    shares(2, 0) = 1.0;
    return shares;
  }

  static Eigen::Vector3d curvatureShares()
  {
    return Eigen::Vector3d::UnitX();
  }

  // I-2 (ii), s = circular cylinder: z' = normalise(n - x x^T n) (paper eq. (5): [x y
  // z] is a rotation only with z normal to x), apex on the axis' near side. None when n
  // is along the axis.
  static std::optional<SurfacePlacement> place(const PlacementRequest& request)
  {
    constexpr double kSmallestSine = 1e-3;
    const UnboundedSurface& surface = request.surface;
    const NormalMap normal = normalMap(request);
    const double k = safeGap(surface.k[0], 1.0);
    const double across = std::hypot(normal.n.y(), normal.n.z());
    if (across < kSmallestSine)
      return std::nullopt;
    const Eigen::Vector3d x = Eigen::Vector3d::UnitX(), z = Eigen::Vector3d::UnitZ();
    const Eigen::Vector3d up(0.0, normal.n.y() / across, normal.n.z() / across);
    JointRows3 tilt = JointRows3::Zero(); // delta of the fit
    tilt(1, 1) = tilt(2, 2) = 1.0;
    // n seen from the moving frame, and its turn about x.
    const JointRows3 dn = normal.dn + skew(normal.n) * tilt;
    const JointRow roll = (up.y() * dn.row(2) - up.z() * dn.row(1)) / across;
    SurfacePlacement p{surface.R, surface.c + surface.R * (z - up) / k, surface.R * up};
    p.R.col(2) = p.z;
    p.R.col(1) = p.R.col(2).cross(p.R.col(0));
    p.delta = tilt;
    p.delta.row(0) += roll;
    p.gamma = (skew(z - up) * tilt / -k).eval();
    p.gamma -= x.cross(up) * roll / k;
    p.gamma(1, 3) += 1.0;
    p.gamma(2, 4) += 1.0;
    p.gamma.col(0) += (up - z) / (k * k);
    return p;
  }

private:
  // Turns the frame about z so that x is the direction of the smaller |curvature|.
  static void align(UnboundedSurface& surface)
  {
    const Eigen::Vector3d& k = surface.k;
    const symmetric::PlaneAxes axes = symmetric::planeAxes(k[0], k[1], k[2]);
    const Eigen::Vector2d& x = axes.along_smaller;
    Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
    turn.topLeftCorner<2, 2>() << x.x(), -x.y(), x.y(), x.x();
    surface.R = surface.R * turn;
    surface.k = {axes.larger, 0.0, 0.0};
  }
};

}} // namespace holdfast::models
