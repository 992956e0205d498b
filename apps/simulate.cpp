#include <holdfast/io/atomic_file.h>
#include <holdfast/io/cloud_io.h>
#include <holdfast/io/config.h>
#include <holdfast/patch/parameters.h>
#include <holdfast/pcl/pattern_subtraction.h>
#include <holdfast/sensor/names.h>
#include <holdfast/simulation/simulator.h>
#include <holdfast/version.h>

#include <CLI/CLI.hpp>
#include <Eigen/Geometry>
#include <fmt/core.h>
#include <nlohmann/json.hpp>

#include "command_line.h"
#include "commands.h"
#include "common_options.h"
#include "input_options.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>

namespace holdfast::app {

namespace {

using Json = nlohmann::ordered_json;

struct SimulateArguments {
  std::string scene;
  std::string output;
  std::optional<double> distance_m;
  std::string sensor = "kinect_v1";
  int stride = 1;
  std::uint64_t random_seed = 1;
  SimulationOptions simulation;
  bool no_pattern = false;
  bool covariance = false;
  bool quiet = false; ///< it has nothing to say but errors anyway
  bool ascii = false;
};

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

RangeCloud
toCloud(const RangeImage& image, bool with_covariances)
{
  pcl::PointCloud<pcl::PointXYZ> points(static_cast<std::uint32_t>(image.width),
                                        static_cast<std::uint32_t>(image.height));
  points.is_dense = false;
  for (std::size_t i = 0; i < points.size(); ++i)
    points[i].getVector3fMap() = image.points[i].cast<float>();
  RangeCloud cloud;
  cloud.points = std::make_shared<const pcl::PointCloud<pcl::PointXYZ>>(points);
  cloud.sensor_pose = image.sensor_pose;
  if (with_covariances) {
    auto covariances = std::make_shared<Covariances>();
    for (const Eigen::Matrix3d& Sigma : image.covariances)
      covariances->push_back(Sigma.cast<float>());
    cloud.covariances = covariances;
  }
  return cloud;
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

Json
sensorJson(const Sensor& sensor, const Camera& camera, int stride, const Pose& pose)
{
  const Eigen::Quaterniond q(pose.R);
  return {{"name", sensor.name},
          {"noise", sensor.noise->name()},
          {"pattern", patternJson(sensor.pattern, stride)},
          {"camera",
           {{"width", camera.width},
            {"height", camera.height},
            {"fx", camera.fx},
            {"fy", camera.fy},
            {"cx", camera.cx},
            {"cy", camera.cy}}},
          {"position", numbers(pose.c)},
          {"orientation_wxyz", {q.w(), q.x(), q.y(), q.z()}}};
}

/// Everything that was true of the scene; lengths in metres, angles in radians.
Json
truthJson(const SimulateArguments& arguments,
          const Scene& scene,
          const Sensor& sensor,
          const Camera& camera)
{
  Json patches = Json::array();
  for (const Patch& patch : scene.patches)
    patches.push_back(patchJson(patch));
  Json shapes = Json::array();
  for (const auto& shape : scene.shapes)
    shapes.push_back(shapeJson(*shape));
  return {{"holdfast", HOLDFAST_VERSION},
          {"cloud", std::filesystem::path(arguments.output).filename().string()},
          {"scene", scene.name},
          {"random_seed", arguments.random_seed},
          {"noise_scale", arguments.simulation.noise_scale},
          {"quantized", arguments.simulation.quantize},
          {"stride", arguments.stride},
          {"sensor", sensorJson(sensor, camera, arguments.stride, scene.sensor_pose)},
          {"patches", patches},
          {"shapes", shapes}};
}

/// Writes both files or, as far as that is possible, none.
void
save(const std::string& output, const RangeCloud& cloud, bool ascii, const Json& truth)
{
  saveCloud(output, cloud, ascii);
  try {
    const auto truth_path =
        std::filesystem::path(output).replace_extension(".truth.json");
    AtomicFile file(truth_path.string());
    file.stream() << truth.dump(2) << '\n';
    file.commit();
  }
  catch (...) {
    std::error_code ignored;
    std::filesystem::remove(output, ignored);
    throw;
  }
}

/// The camera adds what subtractPatternMap() takes away: a cloud with covariances of
/// its own stays as it is. After any rounding, so that what is left is in whole steps.
RangeCloud
withPatternMap(const RangeCloud& cloud, const Sensor& sensor, double noise_scale)
{
  if (!sensor.pattern_map)
    return cloud;
  std::vector<float> errors = sensor.pattern_map->errors();
  for (float& error : errors)
    error *= -static_cast<float>(noise_scale);
  Sensor opposite = sensor;
  opposite.pattern_map = std::make_shared<const PatternMap>(sensor.camera.width,
                                                            sensor.camera.height,
                                                            errors);
  return subtractPatternMap(cloud, opposite);
}

void
runSimulate(const SimulateArguments& arguments)
{
  const Sensor named = loadSensor(arguments.sensor);
  const Sensor sensor = arguments.no_pattern ? withoutPattern(named) : named;
  if (sensor.pattern_map && arguments.stride > 1)
    throw CLI::ValidationError("--stride",
                               fmt::format("sensor {} has a pattern map of all its "
                                           "pixels; --no-pattern simulates without it",
                                           sensor.name));
  if (arguments.simulation.quantize && sensor.disparity_quantum_px == 0.0)
    throw CLI::ValidationError("--quantize",
                               "sensor " + sensor.name + " has no disparity quantum");
  const Scene scene = makeScene(arguments.scene, arguments.distance_m);
  const RayGrid rays = pixelRays(sensor.camera, arguments.stride);
  std::mt19937_64 generator(arguments.random_seed);
  const RangeImage image =
      simulate(scene, rays, sensor, arguments.simulation, generator);
  if (std::none_of(image.points.begin(), image.points.end(), [](const auto& point) {
        return point.allFinite();
      }))
    throw std::runtime_error(
        fmt::format("{}: not written, nothing of the scene {} lies "
                    "within the range of sensor {}",
                    arguments.output,
                    scene.name,
                    sensor.name));
  save(arguments.output,
       withPatternMap(toCloud(image, arguments.covariance),
                      sensor,
                      arguments.simulation.noise_scale),
       arguments.ascii,
       truthJson(arguments,
                 scene,
                 sensor,
                 strided(sensor.camera, rays, arguments.stride)));
}

std::string
joined(const std::vector<std::string>& words)
{
  std::string text;
  for (const std::string& word : words)
    text += (text.empty() ? "" : ", ") + word;
  return text;
}

// Checks for CLI11: an empty string, or what is wrong.

std::string
requireScene(const std::string& name)
{
  std::string plain = name;
  std::replace(plain.begin(), plain.end(), '-', '_');
  const std::vector<std::string> names = sceneNames();
  const bool known = std::find(names.begin(), names.end(), plain) != names.end();
  return known ? "" : "no scene " + name + "; there are " + joined(names);
}

std::string
requireFactor(const std::string& text)
{
  const auto value = parseNumber<double>(text);
  return value && std::isfinite(*value) && *value >= 0.0 ?
             "" :
             text + " is not a number >= 0";
}

std::string
requirePcd(const std::string& path)
{
  const bool is_pcd = std::filesystem::path(path).extension() == ".pcd";
  return is_pcd ? "" : path + ": the cloud is written as PCD; name it *.pcd";
}

void
addSceneOptions(CLI::App& command, SimulateArguments& arguments)
{
  command.add_option("SCENE", arguments.scene, "one of " + joined(sceneNames()))
      ->required()
      ->check(requireScene)
      ->type_name("");
  command
      .add_option("-o,--output",
                  arguments.output,
                  "cloud to write (*.pcd, organized, world frame, VIEWPOINT: the "
                  "sensor's pose); the truth goes to *.truth.json beside it")
      ->required()
      ->check(requirePcd)
      ->type_name("CLOUD.pcd");
  command
      .add_option("--distance",
                  arguments.distance_m,
                  "from the sensor to the middle of the scene, m (default: 1 for "
                  "patches, 1.2 for the others)")
      ->check(positiveNumber("M"))
      ->type_name("");
  command
      .add_option("--sensor",
                  arguments.sensor,
                  "YAML file, or one of " + joined(listSensors()))
      ->capture_default_str()
      ->type_name("NAME|FILE");
  command.add_option("--stride", arguments.stride, "use every N-th row and column, px")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str()
      ->type_name("N");
}

void
addNoiseOptions(CLI::App& command, SimulateArguments& arguments)
{
  command.add_option("--random-seed", arguments.random_seed, "seed of the noise")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str()
      ->type_name("N");
  command
      .add_option("--noise-scale",
                  arguments.simulation.noise_scale,
                  "factor on the sensor's standard deviations; 0: no noise")
      ->check(requireFactor)
      ->capture_default_str()
      ->type_name("X");
  command.add_flag("--no-pattern",
                   arguments.no_pattern,
                   "draw the errors of neighbouring pixels independently, also where "
                   "the sensor file says what they share (its pattern); a fit of such "
                   "a cloud wants --no-pattern, too");
  command.add_flag("--quantize",
                   arguments.simulation.quantize,
                   "round the disparity to the sensor's steps, after the noise");
  command.add_flag(
      "--covariance",
      arguments.covariance,
      "write the covariance of each point's noise too (m^2); what neighbouring "
      "pixels share of it is not in the cloud then, and a fit of it "
      "takes them as independent");
  command.add_flag("--ascii", arguments.ascii, "text instead of binary PCD");
  addQuietOption(command, arguments.quiet);
}

} // namespace

void
addSimulateCommand(CLI::App& app, int& exit_code)
{
  auto arguments = std::make_shared<SimulateArguments>();
  CLI::App* command =
      app.add_subcommand("simulate", "Make a depth camera's cloud of a known scene");
  addSceneOptions(*command, *arguments);
  addNoiseOptions(*command, *arguments);
  command->footer("Examples:\n"
                  "  holdfast simulate rocks -o rocks.pcd --quantize\n"
                  "  holdfast simulate sphere -o sphere.pcd --distance 0.8 "
                  "--sensor realsense_d435\n"
                  "  holdfast simulate mix -o mix.pcd --noise-scale 0 --stride 4\n"
                  "  holdfast simulate table -o table.pcd --no-pattern");
  command->callback([arguments, &exit_code] {
    runSimulate(*arguments);
    exit_code = 0;
  });
}

} // namespace holdfast::app
