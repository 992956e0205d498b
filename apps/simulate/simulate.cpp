#include <holdfast/io/cloud_io.h>
#include <holdfast/io/config.h>
#include <holdfast/simulation/simulator.h>

#include <CLI/CLI.hpp>

#include "arguments.h"
#include "command_line.h"
#include "commands.h"
#include "common_options.h"
#include "frames.h"
#include "image_cloud.h"
#include "input_options.h"
#include "truth_json.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

namespace holdfast::app {

namespace {

/// Writes both files or, as far as that is possible, none.
void
save(const std::string& output,
     const RangeCloud& cloud,
     bool ascii,
     const nlohmann::ordered_json& truth)
{
  saveCloud(output, cloud, ascii);
  try {
    saveJson(std::filesystem::path(output).replace_extension(".truth.json").string(),
             truth);
  }
  catch (...) {
    std::error_code ignored;
    std::filesystem::remove(output, ignored);
    throw;
  }
}

void
simulateCloud(const SimulateArguments& arguments, const SimulatedView& view)
{
  std::mt19937_64 generator(arguments.random_seed);
  const RangeImage image =
      simulate(view.scene, view.rays, view.sensor, arguments.simulation, generator);
  if (!seesAnything(image))
    throw std::runtime_error(arguments.output + ": not written, nothing of the scene " +
                             view.scene.name + " lies within the range of sensor " +
                             view.sensor.name);
  save(arguments.output,
       cloudOf(image,
               view.sensor,
               arguments.simulation.noise_scale,
               arguments.covariance),
       arguments.ascii,
       truthJson(arguments, view));
}

/// \throw CLI::ValidationError when options make no sense for the sensor.
void
checkAgainst(const Sensor& sensor, const SimulateArguments& arguments)
{
  if (sensor.pattern_map && arguments.stride > 1)
    throw CLI::ValidationError("--stride",
                               "sensor " + sensor.name +
                                   " has a pattern map of all its pixels; --no-pattern "
                                   "simulates without it");
  if (arguments.simulation.quantize && sensor.disparity_quantum_px == 0.0)
    throw CLI::ValidationError("--quantize",
                               "sensor " + sensor.name + " has no disparity quantum");
  if (arguments.moving.fresh_pattern && sensor.pattern.empty())
    throw CLI::ValidationError("--fresh-pattern",
                               "sensor " + sensor.name + " has no pattern");
}

/// \throw CLI::ValidationError when options make no sense together.
void
checkTogether(const SimulateArguments& arguments)
{
  const bool is_pcd = std::filesystem::path(arguments.output).extension() == ".pcd";
  const TrajectoryArguments& moving = arguments.moving;
  if (moving.trajectory.empty() && !is_pcd)
    throw CLI::ValidationError("--output",
                               arguments.output +
                                   ": the cloud is written as PCD; name it *.pcd");
  if (!moving.trajectory.empty() && is_pcd)
    throw CLI::ValidationError("--output",
                               arguments.output +
                                   ": with --trajectory a folder is written");
  if (arguments.distance_m && !moving.trajectory.empty() &&
      moving.trajectory != "circle")
    throw CLI::ValidationError("--distance", "is of use to --trajectory circle alone");
  if (moving.step_m && !moving.isMadeUp())
    throw CLI::ValidationError("--step",
                               "is of no use where the poses are those of a file");
}

void
runSimulate(const SimulateArguments& arguments)
{
  checkTogether(arguments);
  const Sensor named = loadSensor(arguments.sensor);
  const Sensor sensor = arguments.no_pattern ? withoutPattern(named) : named;
  checkAgainst(sensor, arguments);
  const Scene scene = makeScene(arguments.scene, arguments.distance_m);
  const RayGrid rays = pixelRays(sensor.camera, arguments.stride);
  const SimulatedView view{scene, sensor, rays};
  if (arguments.moving.trajectory.empty())
    simulateCloud(arguments, view);
  else
    simulateFrames(arguments, view);
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
                  "sensor's pose); the truth goes to *.truth.json beside it. With "
                  "--trajectory a folder, new or empty")
      ->required()
      ->type_name("CLOUD.pcd|FOLDER");
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

void
addTrajectoryOptions(CLI::App& command, TrajectoryArguments& moving)
{
  constexpr const char* kGroup = "Moving cameras";
  CLI::Option* trajectory = command.add_option(
      "--trajectory",
      moving.trajectory,
      "write what a moving camera sees: frame_0000.pcd etc. in the camera's own frame, "
      "its poses as trajectory.txt (TUM format) and truth.json. walk: carried along "
      "the scene by a walking robot, 1.2 m high, looking ahead and 45 degrees down; "
      "circle: around the middle of the scene; or a file of poses (t tx ty tz qx qy qz "
      "qw, of the camera in the world)");
  trajectory->type_name("walk|circle|FILE")->group(kGroup);
  const auto add = [&](const std::string& name, auto& value, const std::string& help) {
    return command.add_option(name, value, help)->needs(trajectory)->group(kGroup);
  };
  add("--frames", moving.frames, "how many (default: 30, or all of the file)")
      ->check(CLI::Range(2, 10000))
      ->type_name("N");
  add("--step",
      moving.step_m,
      "way from frame to frame, m; 0: stands still (default: 0.1)")
      ->check(requireFactor)
      ->type_name("M");
  add("--odometry-sigma-rad",
      moving.odometry_sigma_rad,
      "write odometry.txt too: the true increments from frame to frame, each with this "
      "error about each axis, rad, added up (default: 0)")
      ->check(requireFactor)
      ->type_name("RAD");
  add("--odometry-sigma-m",
      moving.odometry_sigma_m,
      "the same along each axis, m (default: 0)")
      ->check(requireFactor)
      ->type_name("M");
  command
      .add_flag(
          "--fresh-pattern",
          moving.fresh_pattern,
          "draw what neighbouring pixels share anew for every frame; otherwise it "
          "stays with the pixels, as in a camera, and does not average out")
      ->needs(trajectory)
      ->excludes("--no-pattern")
      ->group(kGroup);
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
  addTrajectoryOptions(*command, arguments->moving);
  command->footer("Examples:\n"
                  "  holdfast simulate rocks -o rocks.pcd --quantize\n"
                  "  holdfast simulate sphere -o sphere.pcd --distance 0.8 "
                  "--sensor realsense_d435\n"
                  "  holdfast simulate mix -o mix.pcd --noise-scale 0 --stride 4\n"
                  "  holdfast simulate table -o table.pcd --no-pattern\n"
                  "  holdfast simulate boulder_field --trajectory walk --frames 100 "
                  "-o walk --odometry-sigma-m 0.002 --odometry-sigma-rad 0.002");
  command->callback([arguments, &exit_code] {
    runSimulate(*arguments);
    exit_code = 0;
  });
}

} // namespace holdfast::app
