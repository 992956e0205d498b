#include "second_order.h"

#include "geometry/symmetric.h"
#include "geometry/symmetric_eigen.h"
#include <holdfast/geometry/gaussian.h>
#include <holdfast/geometry/rotation.h>

#include <cmath>

namespace holdfast {
namespace {

using Joint = Eigen::Matrix<double, JointLayout::kSize, 1>;
using JointMatrix = Eigen::Matrix<double, JointLayout::kSize, JointLayout::kSize>;
// Parameters, then the coordinates of the state.
using Output =
    Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMaxParameters + kMaxState, 1>;
using OutputMatrix = Eigen::Matrix<double,
                                   Eigen::Dynamic,
                                   Eigen::Dynamic,
                                   0,
                                   kMaxParameters + kMaxState,
                                   kMaxParameters + kMaxState>;

// The scatter moved by (mean, scatter) entries given in the axes of R.
Scatter
movedScatter(const Scatter& scatter, const Eigen::Matrix3d& R, const Joint& x)
{
  const Eigen::Matrix<double, 6, 1> s = x.segment<6>(JointLayout::kScatter);
  const Eigen::Matrix3d dC = symmetric::matrixOf(s);
  const Eigen::Vector3d mean = scatter.mean + R * x.segment<3>(JointLayout::kMean);
  return withMoments(scatter, mean, scatter.covariance + R * dC * R.transpose());
}

// F at a displacement of the joint variables, r in the representation nearest to the
// reference.
class PatchMap {
public:
  PatchMap(const PatchFit& fit,
           const PatchFitter& fitter,
           const Eigen::Vector3d& origin)
  : fit_(fit), fitter_(fitter), origin_(origin), reference_(fit.bounded.patch)
  {}

  Output operator()(const Joint& x) const
  {
    const UnboundedSurface& surface = fit_.surface.surface;
    const Scatter scatter = movedScatter(fit_.scatter, surface.R, x);
    const UnboundedSurface moved =
        retractedSurface(surface, scatter, Theta(x.head<6>()));
    UnboundedSurface plane;
    if (fit_.has_plane_stage) {
      Theta step = Theta::Zero();
      step.head<3>() = x.tail<3>();
      plane = retractedSurface(fit_.plane.surface, scatter, step);
    }
    const BoundedPatch bounded = fitter_.bound({reference_.type,
                                                moved,
                                                scatter,
                                                fit_.has_plane_stage ? &plane : nullptr,
                                                origin_});
    const ParameterVector parameters =
        pack(nearestRepresentation(bounded.patch, reference_));
    const StateVector state = difference(bounded.state, fit_.bounded.state);
    Output output(parameters.size() + state.size());
    output << parameters, state;
    return output;
  }

private:
  const PatchFit& fit_;
  const PatchFitter& fitter_;
  Eigen::Vector3d origin_;
  Patch reference_;
};

} // namespace

SecondOrderTerms
secondOrderTerms(const PatchFit& fit,
                 const PatchFitter& fitter,
                 const Eigen::Vector3d& origin,
                 const JointMatrix& joint)
{
  const PatchMap F(fit, fitter, origin);
  // Columns of the root: one-sigma displacements. Null directions are left out.
  // Variables differ in unit by orders of magnitude: whiten them one by one first.
  const Joint scale = joint.diagonal().cwiseMax(0.0).cwiseSqrt();
  const Joint inverse =
      scale.unaryExpr([](double s) { return s > 0.0 ? 1.0 / s : 0.0; });
  const SymmetricEigen eigen =
      symmetricEigen(inverse.asDiagonal() * joint * inverse.asDiagonal());
  constexpr double kNull = 1e-9;
  std::vector<Joint> steps;
  for (int i = 0; i < JointLayout::kSize; ++i)
    if (eigen.values[i] > kNull)
      steps.push_back(
          scale.cwiseProduct(std::sqrt(eigen.values[i]) * eigen.vectors.col(i)));

  const Output at = F(Joint::Zero());
  const int n = static_cast<int>(at.size()), m = static_cast<int>(steps.size());
  std::vector<Output> plus(steps.size()), minus(steps.size());
  for (int i = 0; i < m; ++i) {
    plus[i] = F(steps[i]);
    minus[i] = F(-steps[i]);
  }
  Output shift = Output::Zero(n);
  OutputMatrix covariance = OutputMatrix::Zero(n, n);
  for (int i = 0; i < m; ++i) {
    const Output diagonal = plus[i] - 2.0 * at + minus[i];
    shift += 0.5 * diagonal;
    covariance += 0.5 * diagonal * diagonal.transpose();
    for (int j = 0; j < i; ++j) {
      // Cross difference of step one, symmetric: error of third order.
      const Output mixed = 0.5 * (F(steps[i] + steps[j]) + F(-steps[i] - steps[j]) -
                                  plus[i] - minus[i] - plus[j] - minus[j] + 2.0 * at);
      covariance += mixed * mixed.transpose();
    }
  }
  const int states = stateLayoutOf(fit.bounded.state.type).size();
  return {covariance.topLeftCorner(n - states, n - states),
          shift.head(n - states),
          covariance.bottomRightCorner(states, states),
          shift.tail(states)};
}

} // namespace holdfast
