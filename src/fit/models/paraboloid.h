// Paraboloid: kxx kxy kyy, delta_x delta_y, a (c = mean + a normal, of the scatter).
#pragma once

#include "model.h"

#include <cmath>

namespace holdfast { namespace models {

struct Paraboloid : ModelBase<kernel::Model::Paraboloid> {
  static constexpr int kFirstRotation = 3;
  static constexpr bool kWraps = false;

  static void addCurvatureTerms(const UnboundedSurface& surface,
                                const double L[],
                                ThetaMatrix& H)
  {
    using namespace kernel;
    const Eigen::Vector3d& k = surface.k;
    H(0, 4) -= 2.0 * L[PXZ];
    H(1, 3) += 2.0 * L[PXZ];
    H(1, 4) -= 2.0 * L[PYZ];
    H(2, 3) += 2.0 * L[PYZ];
    H(3, 3) += 2.0 * (k[2] * (L[PZZ] - L[PYY]) - k[1] * L[PXY] + L[PZ]);
    H(4, 4) += 2.0 * (k[0] * (L[PZZ] - L[PXX]) - k[1] * L[PXY] + L[PZ]);
    H(3, 4) += (k[0] + k[2]) * L[PXY] + k[1] * (L[PXX] + L[PYY] - 2.0 * L[PZZ]);
  }

  // c = mean + a n(C).
  static ThetaByMoments momentCross(const UnboundedSurface& surface,
                                    const Scatter& scatter,
                                    const kernel::CovarianceSums& sums)
  {
    const Eigen::Matrix3d C = surface.R.transpose() * scatter.covariance * surface.R;
    const Eigen::Matrix<double, 3, 6> dn =
        normalJacobian(C, surface.R.transpose() * scatter.normal());
    const auto T = crossSumMatrix(sums, kParameters);
    ThetaByMoments A = ThetaByMoments::Zero();
    A.leftCols<3>() = -T;
    A.rightCols<6>() = (-surface.a * T).lazyProduct(dn);
    A.row(5).tail<6>() += centreGradient(surface.k, sums.L).transpose() * dn;
    return A;
  }

  static Eigen::Matrix3d translations(const UnboundedSurface& surface,
                                      const Scatter& scatter)
  {
    Eigen::Matrix3d directions = Eigen::Matrix3d::Identity();
    directions.col(0) = surface.R.transpose() * scatter.normal();
    return directions;
  }

  static UnboundedSurface retracted(const UnboundedSurface& surface,
                                    const Scatter& scatter,
                                    const Theta& step)
  {
    UnboundedSurface next =
        movedFrame(surface, {step[3], step[4], 0.0}, Eigen::Vector3d::Zero());
    next.k += step.head<3>();
    next.a += step[5];
    next.c = scatter.mean + next.a * scatter.normal();
    return next;
  }

  static UnboundedSurface start(const StartRequest& request)
  {
    return quadricStart(kModel, request);
  }

  static double largestCurvature(const Eigen::Vector3d& k)
  {
    const double mean = 0.5 * (k[0] + k[2]);
    return std::abs(mean) + std::hypot(0.5 * (k[0] - k[2]), k[1]);
  }

  static Eigen::Matrix3d curvatureMatrix()
  {
    return Eigen::Matrix3d::Identity();
  }

  static Eigen::Vector3d curvatureShares()
  {
    return {0.5, 0.0, 0.5};
  }

  // delta and gamma of the paraboloid's frame, I-2: c = mean + a n.
  static std::optional<SurfacePlacement> place(const PlacementRequest& request)
  {
    const UnboundedSurface& surface = request.surface;
    // The line of its centre is the scatter's normal, whatever else there is.
    const NormalMap normal = normalMap({surface, request.scatter, nullptr, false});
    SurfacePlacement p{surface.R, surface.c, surface.R.col(2)};
    p.delta(0, 3) = p.delta(1, 4) = 1.0;
    p.gamma.middleCols<3>(JointLayout::kMean).setIdentity();
    p.gamma += surface.a * normal.dn;
    p.gamma.col(5) += normal.n;
    return p;
  }

private:
  // E_c = L[-g], local axes.
  static Eigen::Vector3d centreGradient(const Eigen::Vector3d& k, const double L[])
  {
    using namespace kernel;
    return {-2.0 * (k[0] * L[PX] + k[1] * L[PY]),
            -2.0 * (k[1] * L[PX] + k[2] * L[PY]),
            2.0 * L[P1]};
  }
};

}} // namespace holdfast::models
