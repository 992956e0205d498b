/// \file Where to evaluate a noise model: at the surface, not at the noisy point.
#pragma once

#include <holdfast/fit/point_batch.h>

namespace holdfast {

/// Moves every point along its ray from the viewpoint onto the least-squares quadric of
/// the points, into the channels RX, RY, RZ. A noise model evaluated at the noisy
/// points themselves gives those measured too near too much weight, which pulls the
/// centre of a patch towards the sensor by a good part of its sigma.
///
/// \param batch coordinates are read, covariances are not; it is padded.
/// \param viewpoint in the coordinates of the batch's X, Y, Z channels.
void computeReferencePoints(PointBatch& batch, const Eigen::Vector3d& viewpoint);

} // namespace holdfast
