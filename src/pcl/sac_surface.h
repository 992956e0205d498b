/// \file The surfaces that sample consensus can look for.
#pragma once

#include "fit/kernel.h"
#include <holdfast/pcl/impl/sac_engine.h>

#include "sac_minimal_solvers.h"

namespace holdfast {

/// What sample consensus must know of a surface. To add one, add a row to the table in
/// sac_surface.cpp: everything else works with any patch.
struct SacSurface {
  SurfaceRequest request;
  int model_type; ///< pcl::SacModel or PatchSacModel
  kernel::Model model; ///< as the weighted fit sees it
  unsigned int sample_size;
  unsigned int model_size; ///< number of coefficients
  std::optional<Patch> (*solve)(const Sample& sample,
                                const Eigen::Vector3d& viewpoint,
                                const PatchFitter& fitter);
  /// \param coefficients model_size finite numbers; nothing if they make no surface.
  std::optional<Patch> (*fromCoefficients)(const Eigen::VectorXd& coefficients);
  Eigen::VectorXd (*toCoefficients)(const Patch& patch);
};

const SacSurface& sacSurface(SurfaceRequest request);

} // namespace holdfast
