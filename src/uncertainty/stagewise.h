/// \file The covariance of a patch by the paper's chain of stages (paper Fig. 4).
#pragma once

#include "fit/fit_patch.h"

namespace holdfast {

/// Covariance of [d | k | r | c] by the paper's chain of stages, eqs. (3)-(17).
///
/// Starts from (J^T J)^-1 of the weighted fits and pushes it stage by stage to the
/// bounded patch. Misprints of the paper are corrected; its independence assumptions
/// are kept, so that the two can be compared:
///   - the centroid is independent of the plane fitted to the same points, eq. (3);
///   - the line on which the centre of a paraboloid lies is known exactly (I-2), so the
///     centre has no uncertainty across it;
///   - the normal that sphere and cylinder take from stage I-1 is independent of their
///     own fit, eqs. (4) and (5);
///   - the points are independent of the surface they gave, eq. (11).
/// For planes that loses nothing: the sigmas are those of patchCovariance(). For curved
/// patches most sigmas agree within 20 %, but not those of the centre across the
/// normal: about a tenth of the true ones for paraboloids, and 2 to 8 times the true
/// ones for spheres and across the axis of cylinders, whose bounds there come out up to
/// 1.4 times too uncertain (patches of 0.1 m seen from 1 m).
///
/// \param fit with the patch in canonical form, as PatchFitter::fit() returns it.
/// \param batch the points as PatchFitter::fit() left them.
/// \param options those of the fit.
/// \return world frame; symmetric and positive semi-definite within rounding; 0 x 0
/// unless fit.status is FitStatus::Converged.
ParameterMatrix stagewiseCovariance(const PatchFit& fit,
                                    const PointBatch& batch,
                                    const FitOptions& options);

} // namespace holdfast
