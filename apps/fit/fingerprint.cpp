#include "fingerprint.h"

#include "hash.h"

#include <holdfast/version.h>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <array>
#include <set>

namespace holdfast::app {
namespace {

/// What does not change a result. An option that is not here does: forgotten, it costs
/// time, not a stale result.
const std::set<std::string> kNeutral{"--format",
                                     "--help",
                                     "--json",
                                     "--manifest",
                                     "--output",
                                     "--quiet",
                                     "--resume",
                                     "--retry-failed",
                                     "--sensor",
                                     "--shard",
                                     "--threads",
                                     "CLOUD"};

std::string
optionsText(const CLI::App& command)
{
  std::string text;
  for (const CLI::Option* option : command.get_options()) {
    const std::string name = option->get_name();
    if (option->count() == 0 || kNeutral.count(name) != 0 || name == "-o")
      continue;
    text += name;
    for (const std::string& value : option->results())
      text += ' ' + value;
    text += '\n';
  }
  return text;
}

/// What the noise model says of points all over its camera's view: parameters that it
/// does not tell.
std::string
noiseText(const Sensor& sensor)
{
  if (!sensor.noise)
    return "none";
  std::string text = sensor.noise->name();
  for (const double z : {0.3, 0.7, 1.3, 2.9, 6.1})
    for (const double x : {-0.31, 0.0, 0.47})
      for (const double y : {-0.23, 0.0, 0.37}) {
        const Eigen::Vector3d q = z * Eigen::Vector3d(x, y, 1.0);
        const Eigen::Matrix3d Sigma = sensor.noise->covariance(q);
        const Eigen::Vector3d along = sensor.noise->patternDirection(q);
        for (Eigen::Index i = 0; i < 3; ++i)
          text += fmt::format(" {} {} {} {}",
                              Sigma(i, 0),
                              Sigma(i, 1),
                              Sigma(i, 2),
                              along(i));
      }
  return text;
}

std::string
sensorText(const Sensor& sensor)
{
  const Camera& camera = sensor.camera;
  std::string text = fmt::format("{} {} {} {} {} {} {}\n",
                                 sensor.name,
                                 camera.width,
                                 camera.height,
                                 camera.fx,
                                 camera.fy,
                                 camera.cx,
                                 camera.cy);
  text += fmt::format("{} {} {} {} {}\n",
                      sensor.min_range_m,
                      sensor.max_range_m,
                      sensor.disparity_quantum_px,
                      sensor.baseline_m,
                      sensor.disparity_focal_px);
  for (const PatternWave& wave : sensor.pattern.waves)
    text += fmt::format("{} {} {}\n",
                        wave.sigma,
                        wave.length_px,
                        static_cast<int>(wave.shape));
  text += noiseText(sensor) + '\n';
  if (sensor.pattern_map) {
    const std::vector<float>& errors = sensor.pattern_map->errors();
    const std::string_view bytes(reinterpret_cast<const char*>(errors.data()),
                                 errors.size() * sizeof(float));
    text += fmt::format("{} {:016x}\n", sensor.pattern_map->width(), stableHash(bytes));
  }
  return text;
}

} // namespace

std::string
fingerprintOf(const CLI::App& command, const Sensor& sensor)
{
  return fmt::format(
      "{:016x}",
      stableHash(HOLDFAST_VERSION "\n" + optionsText(command) + sensorText(sensor)));
}

} // namespace holdfast::app
