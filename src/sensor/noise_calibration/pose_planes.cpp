#include "pose_planes.h"

#include "frames.h"

#include <algorithm>
#include <stdexcept>

namespace holdfast {

PosePlanes
findPosePlanes(const PoseFrames& pose, const NoiseCalibrationOptions& options)
{
  PosePlanes found;
  const DisparityStack stack(pose, options);
  found.tiles = stack.tiles(pose, options);
  const FlatRegions flat = findFlatRegions(found.tiles, options);
  if (!flat.are_planes) {
    const bool is_static = std::any_of(found.tiles.tiles.begin(),
                                       found.tiles.tiles.end(),
                                       [](const Tile& tile) { return tile.usable; });
    found.status = is_static ? NoiseCalibrationStatus::NothingFlat :
                               NoiseCalibrationStatus::NothingStatic;
    return found;
  }
  found.regions = flat.regions;
  found.images = planeImages(stack, found.tiles, flat.regions);
  return found;
}

PosePlanes
onPlanes(const PoseFrames& pose,
         const std::vector<Region>& planes,
         const NoiseCalibrationOptions& options)
{
  PosePlanes found;
  const DisparityStack stack(pose, options);
  found.tiles = stack.tiles(pose, options);
  found.regions = planes;
  found.images = planeImages(stack, found.tiles, planes);
  return found;
}

void
requireSameSizes(const std::vector<PoseFrames>& poses)
{
  if (poses.empty())
    throw std::invalid_argument("there is no pose");
  for (const PoseFrames& pose : poses) {
    if (pose.empty())
      throw std::invalid_argument("a pose has no frame");
    requireSameSizes(pose);
    if (pose.front().width != poses.front().front().width ||
        pose.front().height != poses.front().front().height)
      throw std::invalid_argument("the frames differ in size");
  }
}

} // namespace holdfast
