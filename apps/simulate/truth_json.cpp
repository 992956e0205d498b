#include "truth_json.h"

#include "io/json_parts.h"

#include <holdfast/io/atomic_file.h>
#include <holdfast/patch/parameters.h>
#include <holdfast/sensor/names.h>
#include <holdfast/version.h>

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

Json
patchJson(const Patch& patch)
{
  return {{"surface", surfaceName(patch.type.surface)},
          {"boundary", boundaryName(patch.type.boundary)},
          {"dof", degreesOfFreedom(patch.type)},
          {"names", parameterNames(patch.type)},
          {"parameters", io::vectorJson(pack(patch))}};
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

/// The pattern that was drawn, in pixels of the image.
NoisePattern
strided(NoisePattern pattern, int stride)
{
  for (PatternWave& wave : pattern.waves)
    wave.length_px /= stride;
  return pattern;
}

/// Without its pose.
Json
sensorJson(const SimulatedView& view, int stride)
{
  const Sensor& sensor = view.sensor;
  const Camera camera = strided(sensor.camera, view.rays, stride);
  return {{"name", sensor.name},
          {"noise", sensor.noise->name()},
          {"pattern", io::patternJson(strided(sensor.pattern, stride))},
          {"camera", io::cameraJson(camera)}};
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
  json["sensor"].update(io::poseJson(view.scene.sensor_pose));
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
