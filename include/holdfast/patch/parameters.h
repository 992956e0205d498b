/// \file THE parameter order [d | k | r | c] and everything that depends on it.
#pragma once

#include <holdfast/patch/patch.h>

#include <string>
#include <vector>

namespace holdfast {

/// Parameter vectors and matrices live on the stack, bounded by the largest type. Their
/// sizes are no multiple of 16 bytes, so Eigen leaves them unaligned and their layout
/// is the same whatever instruction set a caller compiles for.
using ParameterVector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMaxParameters, 1>;
using ParameterMatrix = Eigen::
    Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMaxParameters, kMaxParameters>;

/// Where each group starts and how long it is. The groups follow each other without
/// gap.
struct ParameterLayout {
  int d_count = 0;
  int k_count = 0;
  int r_count = 0;

  int k() const
  {
    return d_count;
  }
  int r() const
  {
    return d_count + k_count;
  }
  int c() const
  {
    return d_count + k_count + r_count;
  }
  int size() const
  {
    return c() + 3;
  }
};

ParameterLayout layoutOf(PatchType type);

/// "d_x", "kappa_y", "gamma", ... in parameter order.
std::vector<std::string> parameterNames(PatchType type);

ParameterVector pack(const Patch& patch);

/// Inverse of pack().
/// \throw std::invalid_argument when the type is illegal or the length is not its DoF.
Patch unpack(PatchType type, const ParameterVector& parameters);

/// Derivative of [d | k | delta | c] with respect to [d | k | r | c], DoF x DoF: the
/// identity but for the rotation block, Jr(r) (2x2 upper left block for revolute
/// types). A covariance S of the parameters is J S J^T in the tangent space, where it
/// does not suffer from the chart's singularity at |r_xy| = pi.
ParameterMatrix tangentJacobian(const Patch& patch);

/// Covariance of [d | k | delta | c] from that of [d | k | r | c].
ParameterMatrix toTangent(const Patch& patch, const ParameterMatrix& covariance);

} // namespace holdfast
