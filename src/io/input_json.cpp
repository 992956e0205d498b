#include "input_json.h"

#include "json_parts.h"

#include <holdfast/io/names.h>

#include <stdexcept>
#include <string>

namespace holdfast::io {

using Json = nlohmann::ordered_json;

namespace {

Json
turnJson(const Eigen::Matrix3d& turn)
{
  Json rows = Json::array();
  for (Eigen::Index i = 0; i < 3; ++i)
    rows.push_back({turn(i, 0), turn(i, 1), turn(i, 2)});
  return rows;
}

} // namespace

Json
inputJson(const CloudFileInfo& file)
{
  return {{"format", file.format},
          {"axes", kCloudAxesNames.of(file.axes)},
          {"turn", turnJson(turnFromCamera(file.axes))},
          {"unit_m", file.unit_m},
          {"depth_scale", file.is_depth_image ? Json(file.depth_scale) : Json()},
          {"zero_points", file.zero_points},
          {"out_of_range_pixels", file.out_of_range_pixels},
          {"camera", file.camera ? cameraJson(*file.camera) : Json()}};
}

CloudFileInfo
inputFromJson(const nlohmann::json& json)
{
  CloudFileInfo file;
  file.format = json.at("format").get<std::string>();
  const std::string axes = json.at("axes").get<std::string>();
  const auto known = kCloudAxesNames.find(axes);
  if (!known)
    throw std::runtime_error("no result of holdfast: unknown axes " + axes);
  file.axes = *known;
  file.unit_m = positiveFromJson(json, "unit_m");
  // Results of earlier versions do not have it.
  if (json.contains("depth_scale") && !json.at("depth_scale").is_null()) {
    file.is_depth_image = true;
    file.depth_scale = positiveFromJson(json, "depth_scale");
  }
  file.zero_points = json.value("zero_points", 0);
  file.out_of_range_pixels = json.value("out_of_range_pixels", 0);
  if (json.contains("camera") && !json.at("camera").is_null())
    file.camera = cameraFromJson(json.at("camera"));
  return file;
}

} // namespace holdfast::io
