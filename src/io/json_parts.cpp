#include "json_parts.h"

#include <holdfast/sensor/names.h>

#include <Eigen/Geometry>

#include <cmath>

namespace holdfast::io {

using Json = nlohmann::ordered_json;

Json
poseJson(const Pose& pose, const Eigen::Vector3d& offset)
{
  const Eigen::Quaterniond q(pose.R);
  return {{"position", vectorJson(pose.c + offset)},
          {"orientation_wxyz", {q.w(), q.x(), q.y(), q.z()}}};
}

Pose
poseFromJson(const nlohmann::json& json, const Eigen::Vector3d& offset)
{
  const Eigen::Vector4d q = vectorFromJson<4>(json.at("orientation_wxyz"));
  if (!(q.norm() > 0.5))
    throw std::runtime_error("has a pose without orientation");
  return {Eigen::Quaterniond(q[0], q[1], q[2], q[3]).normalized().toRotationMatrix(),
          vectorFromJson<3>(json.at("position")) - offset};
}

Json
cameraJson(const Camera& camera)
{
  return {{"width", camera.width},
          {"height", camera.height},
          {"fx", camera.fx},
          {"fy", camera.fy},
          {"cx", camera.cx},
          {"cy", camera.cy}};
}

Camera
cameraFromJson(const nlohmann::json& json)
{
  Camera camera;
  camera.width = json.at("width");
  camera.height = json.at("height");
  camera.fx = positiveFromJson(json, "fx");
  camera.fy = positiveFromJson(json, "fy");
  camera.cx = json.at("cx");
  camera.cy = json.at("cy");
  return camera;
}

Json
patternJson(const NoisePattern& pattern)
{
  Json waves = Json::array();
  for (const PatternWave& wave : pattern.waves)
    waves.push_back({{"sigma", wave.sigma},
                     {"length_px", wave.length_px},
                     {"shape", kPatternShapeNames.of(wave.shape)}});
  return waves;
}

Json
pointsJson(const PointAccounting& points)
{
  return {{"in_file", points.in_cloud},
          {"invalid", points.invalid},
          {"behind_camera", points.behind_camera},
          {"out_of_view", points.out_of_view},
          {"invalid_covariance", points.invalid_covariance},
          {"duplicate", points.duplicate},
          {"used", points.used}};
}

double
positiveFromJson(const nlohmann::json& json, const char* name)
{
  const double number = json.at(name).get<double>();
  if (!(number > 0.0) || !std::isfinite(number))
    throw std::runtime_error(std::string("no result of holdfast: ") + name +
                             " of its input must be positive");
  return number;
}

} // namespace holdfast::io
