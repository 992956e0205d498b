#include "placement.h"

#include "surface_fit.h"

namespace holdfast {

NormalMap
normalMap(const PlacementRequest& request)
{
  const UnboundedSurface& surface = request.surface;
  NormalMap map;
  if (request.plane) {
    const Eigen::Matrix3d turn = surface.R.transpose() * request.plane->R;
    map.n = turn.col(2);
    map.dn.col(JointLayout::kPlane) = -turn.col(1);
    map.dn.col(JointLayout::kPlane + 1) = turn.col(0);
    return map;
  }
  map.n = surface.R.transpose() * request.scatter.normal();
  const Eigen::Matrix3d C =
      surface.R.transpose() * request.scatter.covariance * surface.R;
  map.dn.middleCols<6>(JointLayout::kScatter) = normalJacobian(C, map.n);
  return map;
}

} // namespace holdfast
