#include "risk/risk_input.h"

#include <holdfast/io/cloud_io.h>
#include <holdfast/io/patch_map_file.h>
#include <holdfast/pcl/frame_mapping.h>
#include <holdfast/pcl/intrinsics.h>

#include <pcl/common/point_tests.h>

#include <Eigen/Geometry>
#include <fmt/core.h>

#include <algorithm>
#include <filesystem>
#include <stdexcept>

namespace holdfast::app {
namespace {

namespace fs = std::filesystem;

/// A patch as large as half of the cloud is none of the surface, and takes all points
/// at each of its seeds. \throw std::runtime_error "PATH: cause".
void
requireRoomFor(double radius_m,
               const pcl::PointCloud<pcl::PointXYZ>& points,
               const std::string& path)
{
  Eigen::AlignedBox3d box;
  for (const pcl::PointXYZ& point : points)
    if (pcl::isFinite(point))
      box.extend(point.getVector3fMap().cast<double>());
  if (!box.isEmpty() && radius_m > 0.5 * box.diagonal().norm())
    throw std::runtime_error(fmt::format(
        "{}: patches of a radius of {:.3g} m, as the foot or --radius wants "
        "them, are too large for this cloud, which is {:.3g} m across; is "
        "its unit right (--unit)?",
        path,
        radius_m,
        box.diagonal().norm()));
}

Ground
groundOfCloud(const RiskSettings& settings, const Foot& foot)
{
  Ground ground;
  const Sensor named = loadSensorOption(settings.input.sensor_name);
  const Sensor sensor = settings.no_pattern ? withoutPattern(named) : named;
  CloudFileInfo file;
  RangeCloud cloud =
      loadCloud(settings.source, loadOptions(settings.input, sensor), &file);
  ground.notices = inputNotices(settings.input, file);
  std::string notice;
  const Sensor taken_by = matchedSensor(sensorOf(file, sensor), cloud, &notice);
  if (!notice.empty())
    ground.notices.push_back(notice);
  cloud = withoutPatternMap(settings.source, cloud, taken_by, ground.notices);
  ground.file = file;
  ground.offset = cloud.offset;
  if (!cloud.sensor_pose_given || cloud.sensor_pose.R.isIdentity())
    ground.image_down = cloud.sensor_pose.R.col(1);
  ground.radius_m = settings.radius_m.value_or(patchRadiusFor(foot));
  requireRoomFor(ground.radius_m, *cloud.points, settings.source);

  ExtractionOptions extraction;
  extraction.sampler.radius_m = ground.radius_m;
  extraction.threads = settings.footholds.threads;
  const MappingOptions options = mappingOptionsFor(taken_by, extraction);
  ExtractionResult result;
  ground.map = mapOfCloud(cloud, taken_by, options, &result);
  ground.points = result.points;
  ground.viewpoint_is_credible = result.viewpoint_is_credible;
  ground.notices.insert(ground.notices.end(),
                        result.notices.begin(),
                        result.notices.end());
  if (const auto assumed = assumedViewpoint(cloud, result.viewpoint_is_credible))
    ground.notices.push_back(*assumed);
  return ground;
}

} // namespace

Ground
loadGround(const RiskSettings& settings, const Foot& foot)
{
  if (fs::path(settings.source).extension() == ".json")
    throw std::runtime_error(settings.source +
                             ": is a result, which has no map in it: 'holdfast map' "
                             "writes one with -o FILE.map");
  if (fs::is_directory(settings.source))
    throw std::runtime_error(settings.source +
                             ": is a folder: 'holdfast map' makes a map of the frames "
                             "in it");
  if (!isMapFile(settings.source))
    return groundOfCloud(settings, foot);
  Ground ground;
  ground.map = loadPatchMap(settings.source).map;
  ground.is_map_file = true;
  ground.radius_m = ground.map.options().radius_m;
  return ground;
}

Eigen::Vector3d
defaultLoadDirection(const Ground& ground)
{
  return ground.image_down.value_or(-Eigen::Vector3d::UnitZ());
}

} // namespace holdfast::app
