/// \file What SampleConsensusModelPatch and PatchSegmentation can be asked for.
#pragma once

#include <holdfast/patch_estimator.h>

#include <pcl/sample_consensus/model_types.h>

#include <cstdint>
#include <optional>

namespace holdfast {

/// Model types beside PCL's SACMODEL_PLANE, SACMODEL_SPHERE and SACMODEL_CYLINDER. PCL
/// ends at 18 and its enumeration can hold 31.
enum PatchSacModel : int {
  /// A paraboloid whose patch is whatever the data show: SurfaceRequest::Auto.
  SACMODEL_PATCH = 24,
  SACMODEL_PARABOLOID,
  SACMODEL_ELLIPTIC_PARABOLOID,
  SACMODEL_HYPERBOLIC_PARABOLOID,
  SACMODEL_CYLINDRIC_PARABOLOID,
  SACMODEL_CIRCULAR_PARABOLOID
};

/// The surface of a model type of PCL's or ours; nothing for lines, circles, ...
std::optional<SurfaceRequest> surfaceOfModelType(int model_type);

/// What distances and thresholds are measured in: a number like PCL's 0.01 means quite
/// another thing in sigmas. Of an unlikely one the classes warn.
enum class ConsensusDistance : std::uint8_t {
  /// Standard deviations of the point's noise, by the residual that the fit minimises:
  /// a threshold of 3 keeps 99.7 % of the points of the surface, near and far. Metres
  /// where nothing is known of the noise.
  Mahalanobis,
  Euclidean ///< metres, to the nearest point of the surface
};

struct ConsensusOptions {
  /// Of SampleConsensusModelPatch. PatchSegmentation goes by the threshold that was
  /// set: setSigmaThreshold() or setDistanceThreshold().
  ConsensusDistance distance = ConsensusDistance::Mahalanobis;
  /// fit.surface is that of the model.
  FitOptions fit;
  CovarianceMode covariance = CovarianceMode::Exact;
};

} // namespace holdfast
