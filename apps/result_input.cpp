#include "result_input.h"

#include "risk_result.h"

#include <holdfast/pcl/intrinsics.h>

#include <pcl/common/point_tests.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <utility>

namespace holdfast::app {
namespace {

namespace fs = std::filesystem;

PicturePoints
picturePoints(const RangeCloud& cloud,
              const std::vector<std::array<std::uint8_t, 3>>& colors)
{
  PicturePoints points;
  for (std::size_t i = 0; i < cloud.points->size(); ++i) {
    const pcl::PointXYZ& point = (*cloud.points)[i];
    if (!pcl::isFinite(point))
      continue;
    points.positions.emplace_back(point.getVector3fMap().cast<double>());
    if (colors.size() == cloud.points->size())
      points.colors.push_back(colors[i]);
  }
  return points;
}

/// The middle of the points.
Eigen::Vector3d
centroid(const std::vector<Eigen::Vector3d>& points)
{
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& point : points)
    sum += point;
  return sum / static_cast<double>(points.size());
}

} // namespace

std::string
readResultText(const std::string& path)
{
  std::error_code ignored;
  if (fs::is_directory(path, ignored))
    throw std::runtime_error(path + ": is a directory, no result");
  errno = 0;
  std::ifstream file(path, std::ios::binary);
  if (!file)
    throw std::runtime_error(path + ": cannot be read: " + std::strerror(errno));
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

PatchReport
parseResult(const std::string& path, const std::string& text)
{
  if (isRiskResult(text))
    throw std::runtime_error(path + ": is a result of 'holdfast risk', which 'holdfast "
                                    "render --color risk' draws");
  if (fs::path(path).extension() == ".map")
    throw std::runtime_error(path +
                             ": is a map as 'holdfast map' goes on with it; with "
                             "-o FILE.json it writes one to look at");
  try {
    PatchReport report = readJson(text);
    for (const ExtractedPatch& patch : report.result.patches)
      if (const std::string error = validityError(patch.fit.patch);
          !error.empty() && !(report.is_of_map && !isUsable(patch.fit.status)))
        throw std::runtime_error("has an impossible patch: " + error);
    return report;
  }
  catch (const std::exception& error) {
    throw std::runtime_error(path + ": " + error.what());
  }
}

std::optional<std::string>
findCloud(const std::string& result, const std::string& cloud)
{
  const fs::path folder = fs::path(result).parent_path();
  for (const fs::path& candidate :
       {fs::path(cloud), folder / cloud, folder / fs::path(cloud).filename()}) {
    std::error_code ignored;
    if (fs::is_regular_file(candidate, ignored))
      return candidate.string();
  }
  return std::nullopt;
}

SeenCloud
seenFrom(const Pose& sensor_pose, PicturePoints points)
{
  // No depth camera sees more than 45 degrees to a side.
  const auto aside = std::count_if(points.positions.begin(),
                                   points.positions.end(),
                                   [&](const Eigen::Vector3d& point) {
                                     const Eigen::Vector3d q =
                                         sensor_pose.toLocal(point);
                                     return q.head<2>().cwiseAbs().maxCoeff() > q.z();
                                   });
  SeenCloud cloud;
  cloud.seen = 10 * static_cast<std::size_t>(aside) < points.positions.size();
  cloud.sensor_pose = sensor_pose;
  cloud.points = std::move(points);
  return cloud;
}

CloudReading
readingOf(const PatchReport& report)
{
  return {report.cloud, report.file, report.sensor_pose};
}

SeenCloud
loadSeenCloud(const std::string& path,
              const InputOptions& input,
              const CloudReading& of_result,
              std::vector<std::string>& notices)
{
  const bool is_own = fs::path(path).filename() == fs::path(of_result.cloud).filename();
  const CloudReading reading = is_own ? of_result : CloudReading();
  const Sensor sensor = loadSensorOption(input.sensor_name);
  LoadOptions options = loadOptions(input, sensor, reading);
  options.colors = true;
  CloudFileInfo info;
  const RangeCloud raw = loadCloud(path, options, &info);
  const RangeCloud cloud =
      withoutPatternMap(path, raw, matchedSensor(sensorOf(info, sensor), raw), notices);
  const bool is_said = input.sensor_pose || input.viewpoint;
  const Pose pose =
      is_said ? cloud.sensor_pose : reading.sensor_pose.value_or(cloud.sensor_pose);
  return seenFrom(pose, picturePoints(cloud, info.colors));
}

Standpoint
standpointOf(const SeenCloud& cloud)
{
  const Eigen::Matrix3d& R = cloud.sensor_pose.R;
  Standpoint standpoint;
  if (!cloud.seen)
    return standpoint;
  Eigen::Vector3d& up = standpoint.up;
  if (R.isIdentity()) // the frame of the camera
    up = -Eigen::Vector3d::UnitY();
  const Eigen::Vector3d towards_sensor =
      cloud.sensor_pose.c - centroid(cloud.points.positions);
  // From straight above, the lower edge of the image is the front.
  Eigen::Vector3d front = towards_sensor - towards_sensor.dot(up) * up;
  if (front.norm() < 1e-3 * towards_sensor.norm())
    front = R.col(1) - R.col(1).dot(up) * up;
  standpoint.front = front.normalized();
  return standpoint;
}

Eigen::Vector3d
towardsEye(const Standpoint& standpoint, double azimuth, double elevation)
{
  const Eigen::Vector3d side = standpoint.up.cross(standpoint.front);
  const Eigen::Vector3d out =
      std::cos(azimuth) * standpoint.front + std::sin(azimuth) * side;
  return std::cos(elevation) * out + std::sin(elevation) * standpoint.up;
}

std::vector<ExtractedPatch>
evenShare(const std::vector<ExtractedPatch>& patches, std::size_t count)
{
  if (count >= patches.size())
    return patches;
  std::vector<ExtractedPatch> share;
  for (std::size_t i = 0; i < count; ++i)
    share.push_back(patches[i * patches.size() / count]);
  return share;
}

} // namespace holdfast::app
