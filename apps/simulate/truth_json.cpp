#include "truth_json.h"

#include <holdfast/io/atomic_file.h>
#include <holdfast/patch/parameters.h>
#include <holdfast/sensor/names.h>
#include <holdfast/version.h>

#include <Eigen/Geometry>

#include <filesystem>

namespace holdfast::app {

namespace {

using Json = nlohmann::ordered_json;

/// The camera whose pixel (0, 0), (1, 0), ... are every stride-th of the given one.
Camera
strided(const Camera& camera, const RayGrid& rays, int stride)
{
  Camera result = camera;
  result.width = rays.width;
  result.height = rays.height;
  result.fx /= stride;
  result.fy /= stride;
  result.cx /= stride;
  result.cy /= stride;
  return result;
}

template <typename Derived>
Json
numbers(const Eigen::MatrixBase<Derived>& vector)
{
  Json array = Json::array();
  for (Eigen::Index i = 0; i < vector.size(); ++i)
    array.push_back(vector[i]);
  return array;
}

Json
patchJson(const Patch& patch)
{
  return {{"surface", surfaceName(patch.type.surface)},
          {"boundary", boundaryName(patch.type.boundary)},
          {"dof", degreesOfFreedom(patch.type)},
          {"names", parameterNames(patch.type)},
          {"parameters", numbers(pack(patch))}};
}

Json
shapeJson(const Shape& shape)
{
  Json object = {{"shape", shape.name()}};
  for (const ShapeParameter& parameter : shape.parameters()) {
    if (parameter.values.size() == 1)
      object[parameter.name] = parameter.values.front();
    else
      object[parameter.name] = parameter.values;
  }
  return object;
}

/// The pattern that was drawn, as among the results of a fit: sigmas in the unit of the
/// model, lengths in pixels of the image.
Json
patternJson(const NoisePattern& pattern, int stride)
{
  Json waves = Json::array();
  for (const PatternWave& wave : pattern.waves)
    waves.push_back({{"sigma", wave.sigma},
                     {"length_px", wave.length_px / stride},
                     {"shape", kPatternShapeNames.of(wave.shape)}});
  return waves;
}

/// Without its pose.
Json
sensorJson(const SimulatedView& view, int stride)
{
  const Sensor& sensor = view.sensor;
  const Camera camera = strided(sensor.camera, view.rays, stride);
  return {{"name", sensor.name},
          {"noise", sensor.noise->name()},
          {"pattern", patternJson(sensor.pattern, stride)},
          {"camera",
           {{"width", camera.width},
            {"height", camera.height},
            {"fx", camera.fx},
            {"fy", camera.fy},
            {"cx", camera.cx},
            {"cy", camera.cy}}}};
}

/// Everything but the clouds and where the sensor was.
Json
commonJson(const SimulateArguments& arguments, const SimulatedView& view)
{
  Json patches = Json::array();
  for (const Patch& patch : view.scene.patches)
    patches.push_back(patchJson(patch));
  Json shapes = Json::array();
  for (const auto& shape : view.scene.shapes)
    shapes.push_back(shapeJson(*shape));
  return {{"scene", view.scene.name},
          {"random_seed", arguments.random_seed},
          {"noise_scale", arguments.simulation.noise_scale},
          {"quantized", arguments.simulation.quantize},
          {"stride", arguments.stride},
          {"sensor", sensorJson(view, arguments.stride)},
          {"patches", patches},
          {"shapes", shapes}};
}

} // namespace

Json
truthJson(const SimulateArguments& arguments, const SimulatedView& view)
{
  Json json = {{"holdfast", HOLDFAST_VERSION},
               {"cloud", std::filesystem::path(arguments.output).filename().string()}};
  json.update(commonJson(arguments, view));
  const Pose& pose = view.scene.sensor_pose;
  const Eigen::Quaterniond q(pose.R);
  json["sensor"]["position"] = numbers(pose.c);
  json["sensor"]["orientation_wxyz"] = {q.w(), q.x(), q.y(), q.z()};
  return json;
}

Json
movingTruthJson(const SimulateArguments& arguments,
                const SimulatedView& view,
                const std::vector<std::string>& clouds)
{
  const TrajectoryArguments& moving = arguments.moving;
  Json json = {{"holdfast", HOLDFAST_VERSION},
               {"clouds", clouds},
               {"frame", "sensor"},
               {"trajectory", moving.trajectory}};
  if (moving.isMadeUp())
    json["step_m"] = moving.step();
  json["pattern_over_time"] = moving.fresh_pattern ? "fresh" : "fixed";
  if (moving.wantsOdometry())
    json["odometry"] = {{"sigma_rad", moving.odometry_sigma_rad.value_or(0.0)},
                        {"sigma_m", moving.odometry_sigma_m.value_or(0.0)}};
  json.update(commonJson(arguments, view));
  return json;
}

void
saveJson(const std::string& path, const Json& json)
{
  AtomicFile file(path);
  file.stream() << json.dump(2) << '\n';
  file.commit();
}

} // namespace holdfast::app
