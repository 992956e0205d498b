/// \file A patch as the kernel sees it.
#pragma once

#include "fit/kernel.h"

#include <holdfast/patch/patch.h>
#include <holdfast/patch/surface.h>

#include <Eigen/Core>

namespace holdfast {

/// \param R local axes and \param c centre of the patch in the frame of the
/// coordinates.
inline kernel::PatchForm
patchForm(const Patch& patch, const Eigen::Matrix3d& R, const Eigen::Vector3d& c)
{
  using RowMajor = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
  kernel::PatchForm form{{}, {}, {}, BoundaryForm(patch)};
  Eigen::Map<RowMajor>(form.R) = R;
  Eigen::Map<Eigen::Vector3d>(form.c) = c;
  Eigen::Map<Eigen::Vector3d>(form.k) = implicitDiagonal(patch);
  return form;
}

} // namespace holdfast
