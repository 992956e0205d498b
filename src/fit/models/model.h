// What the surface models have in common.
//
// A model is a struct of static functions, one header each; models.h chooses among
// them. The mathematics per point is in fit/kernel_surface.inl, in the same order of
// theta (kernel::Model). Beside what ModelBase gives it, a model has
//
//   kFirstRotation      theta[kFirstRotation .. kShapeParameters) are rotations
//   kWraps              it closes around its centre or axis: points on it may be no
//                       height field, and it takes its normal from stage I-1
//   addCurvatureTerms   adds L[f_ab] for the shape parameters, upper triangle
//   translations        directions of the translation parameters, local axes, a column
//                       each
//   retracted           the surface moved by a step of theta
//   start               a start about one sigma from the solution
//   largestCurvature    by magnitude, 1/m
//   curvatureMatrix     kxx kxy kyy in the axes of the placement, from k
//   curvatureShares     the weights of k in the one curvature of a round patch
//   place               the frame of a patch; none where the surface has no normal
#pragma once

#include "../placement.h"
#include "../surface_fit.h"
#include "../surface_start.h"

#include <optional>

namespace holdfast { namespace models {

template <kernel::Model model>
struct ModelBase {
  static constexpr kernel::Model kModel = model;
  static constexpr int kParameters = kernel::parameterCount(model);
  static constexpr int kShapeParameters = kernel::shapeParameterCount(model);

  // A = d^2E/dtheta ds: none, unless theta is measured from the moments s.
  static ThetaByMoments momentCross(const UnboundedSurface&,
                                    const Scatter&,
                                    const kernel::CovarianceSums&)
  {
    return ThetaByMoments::Zero();
  }
};

}} // namespace holdfast::models
