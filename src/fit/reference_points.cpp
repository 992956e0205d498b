#include <holdfast/fit/reference_points.h>

#include "fit/surface_fit.h"
#include "fit/surface_start.h"

namespace holdfast {

void
computeReferencePoints(PointBatch& batch, const Eigen::Vector3d& viewpoint)
{
  if (batch.size() == 0)
    return;
  batch.pad();
  const kernel::Points points = kernelPoints(batch);
  const Scatter scatter = measureScatter(batch, false, viewpoint);
  const Quadric quadric = leastSquaresQuadric(points, scatter);
  const double h[6] = {quadric.a0,
                       quadric.slope.x(),
                       quadric.slope.y(),
                       quadric.k[0],
                       quadric.k[1],
                       quadric.k[2]};
  double R[9], c[3], camera[3];
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j)
      R[3 * i + j] = scatter.axes(i, j);
    c[i] = scatter.mean[i];
    camera[i] = viewpoint[i];
  }
  double* const out[3] = {batch.channel(PointBatch::RX),
                          batch.channel(PointBatch::RY),
                          batch.channel(PointBatch::RZ)};
  kernel::kernel().moveOntoQuadric(points, R, c, h, camera, out);
}

} // namespace holdfast
