#include "built_in_files.h"
#include "one_line.h"
#include "yaml_section.h"
#include <holdfast/io/atomic_file.h>
#include <holdfast/io/config.h>
#include <holdfast/io/pattern_map_file.h>
#include <holdfast/sensor/names.h>
#include <holdfast/sensor/noise_registry.h>
#include <holdfast/sensor/parameter_error.h>
#include <holdfast/sensor/stereo_noise_model.h>

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <sstream>
#include <stdexcept>
#include <utility>
#include <vector>

namespace holdfast {

namespace {

namespace fs = std::filesystem;
using io::Section;

Camera
readCamera(Section section)
{
  Camera camera;
  camera.width = section.pixels("width");
  camera.height = section.pixels("height");
  camera.fx = section.positive("fx");
  camera.fy = section.positive("fy");
  camera.cx = section.number("cx");
  camera.cy = section.number("cy");
  section.rejectUnknown();
  return camera;
}

void
readRange(Section section, Sensor& sensor)
{
  sensor.min_range_m = section.number("min_m");
  sensor.max_range_m = section.number("max_m");
  if (sensor.min_range_m < 0.0)
    section.fail("min_m", "must be >= 0");
  if (sensor.max_range_m <= sensor.min_range_m)
    section.fail("max_m", "must be larger than min_m");
  section.rejectUnknown();
}

void
readDisparity(Section section, Sensor& sensor)
{
  sensor.baseline_m = section.positive("baseline_m");
  sensor.disparity_focal_px = section.positive("focal_px");
  if (section.has("quantum_px"))
    sensor.disparity_quantum_px = section.positive("quantum_px");
  section.rejectUnknown();
}

/// The unit of a pattern's sigmas is part of their name.
std::string
patternSigmaName(const NoiseModel& noise)
{
  return noise.name() == "stereo" ? "sigma_px" : "sigma_m";
}

PatternWave
readWave(Section section, const NoiseModel& noise)
{
  PatternWave wave;
  const std::string sigma = patternSigmaName(noise);
  wave.sigma = section.number(sigma);
  if (wave.sigma < 0.0)
    section.fail(sigma, "must be >= 0");
  wave.length_px = section.positive("length_px");
  const std::string shape = section.text("shape");
  const auto found = kPatternShapeNames.find(shape);
  if (!found)
    section.fail("shape", "must be exponential or gaussian, not " + io::oneLine(shape));
  wave.shape = *found;
  section.rejectUnknown();
  return wave;
}

/// Of a single point, in the unit of the pattern's sigmas.
double
singlePointVariance(const NoiseModel& noise)
{
  if (const auto* stereo = dynamic_cast<const StereoNoiseModel*>(&noise))
    return stereo->parameters().sigma_disparity_px *
           stereo->parameters().sigma_disparity_px;
  return noise.covariance(Eigen::Vector3d::UnitZ())(2, 2);
}

/// Empty for a pattern that the noise has room for.
std::string
excessOf(const NoisePattern& pattern, const NoiseModel& noise)
{
  // Sigmas read from decimals add up to that of a point but for their last digits.
  constexpr double kSlack = 1.0 + 1e-9;
  const double variance = pattern.variance(), whole = singlePointVariance(noise);
  if (variance <= kSlack * whole)
    return "";
  return fmt::format("has a sigma of {:.4g} in all, more than the {:.4g} of a single "
                     "point, of which it is a part",
                     std::sqrt(variance),
                     std::sqrt(whole));
}

NoisePattern
readPattern(Section& section, const NoiseModel& noise)
{
  NoisePattern pattern;
  if (!section.has("pattern"))
    return pattern;
  for (const Section& item : section.list("pattern"))
    pattern.waves.push_back(readWave(item, noise));
  if (const std::string excess = excessOf(pattern, noise); !excess.empty())
    section.fail("pattern", excess);
  return pattern;
}

/// The file is named as seen from the folder of the sensor file.
std::shared_ptr<const PatternMap>
readPatternMap(Section& section, const std::string& sensor_file, const Sensor& sensor)
{
  if (!section.has("pattern_map"))
    return nullptr;
  const std::string name = section.text("pattern_map");
  if (sensor.noise->name() != "stereo")
    section.fail("pattern_map",
                 "is of disparities, which the noise model " + sensor.noise->name() +
                     " does not have");
  const fs::path path = fs::path(sensor_file).parent_path() / name;
  try {
    auto map = std::make_shared<const PatternMap>(loadPatternMap(path.string()));
    if (map->width() != sensor.camera.width || map->height() != sensor.camera.height)
      throw std::runtime_error(fmt::format("{}: {} x {} pixels, where the camera has "
                                           "{} x {}",
                                           path.string(),
                                           map->width(),
                                           map->height(),
                                           sensor.camera.width,
                                           sensor.camera.height));
    return map;
  }
  catch (const std::runtime_error& error) {
    section.fail("pattern_map", std::string("is of no use: ") + error.what());
  }
}

/// \param shared values that the model may take from elsewhere in the file.
NoiseModel::ConstPtr
readNoiseModel(Section& section, const NoiseParameters& shared)
{
  const std::string model = section.text("model");
  const NoiseModelKind* kind = findNoiseModelKind(model);
  if (kind == nullptr)
    section.fail("model", "names no noise model: " + io::oneLine(model));
  NoiseParameters parameters;
  for (const NoiseParameter& parameter : kind->parameters) {
    const std::string& name = parameter.name;
    if (!section.has(name) && shared.count(name) > 0)
      parameters[name] = shared.at(name);
    else if (section.has(name) || parameter.required)
      parameters[name] = section.number(name);
  }
  try {
    return makeNoiseModel(model, parameters);
  }
  catch (const ParameterError& error) {
    section.fail(error.parameter(), error.problem());
  }
}

void
readNoise(Section section,
          const NoiseParameters& shared,
          const std::string& file,
          Sensor& sensor)
{
  sensor.noise = readNoiseModel(section, shared);
  sensor.pattern = readPattern(section, *sensor.noise);
  sensor.pattern_map = readPatternMap(section, file, sensor);
  section.rejectUnknown();
}

Sensor
readSensor(Section root)
{
  Sensor sensor;
  sensor.name = root.text("name");
  sensor.camera = readCamera(root.section("camera"));
  readRange(root.section("range"), sensor);
  NoiseParameters shared;
  if (root.has("disparity")) {
    readDisparity(root.section("disparity"), sensor);
    shared = {{"baseline_m", sensor.baseline_m},
              {"focal_px", sensor.disparity_focal_px}};
  }
  readNoise(root.section("noise"), shared, root.file(), sensor);
  root.rejectUnknown();
  return sensor;
}

/// Writes the maps of a sensor file, each key below its comment.
class SectionWriter {
public:
  SectionWriter(std::ostream& out, SensorComments comments)
  : out_(out), comments_(std::move(comments))
  {
    writeComment("", "");
  }

  void begin(const std::string& section)
  {
    out_ << '\n';
    writeComment(section, "");
    out_ << section << ":\n";
    section_ = section + ".";
  }

  void entry(const std::string& key, const std::string& value)
  {
    const std::string indent = section_.empty() ? "" : "  ";
    writeComment(section_ + key, indent);
    out_ << indent << key << ": " << value << '\n';
  }

  void entry(const std::string& key, double value)
  {
    entry(key, fmt::format("{}", value)); // as few digits as read back the same
  }

  /// Below the entry, one in each line, in the short form of YAML.
  void list(const std::string& key, const std::vector<std::string>& maps)
  {
    writeComment(section_ + key, "  ");
    out_ << "  " << key << ":\n";
    for (const std::string& map : maps)
      out_ << "    - {" << map << "}\n";
  }

  /// \throw std::invalid_argument when a comment was left over.
  void finish() const
  {
    if (!comments_.empty())
      throw std::invalid_argument("comment on " + comments_.begin()->first +
                                  ", which the sensor file does not have");
  }

private:
  void writeComment(const std::string& key, const std::string& indent)
  {
    constexpr std::size_t kWidth = 88;
    const auto comment = comments_.extract(key);
    if (comment.empty())
      return;
    std::istringstream words(comment.mapped());
    std::string line = indent + "#", word;
    while (words >> word) {
      if (line.size() + 1 + word.size() > kWidth) {
        out_ << line << '\n';
        line = indent + "#";
      }
      line += " " + word;
    }
    out_ << line << '\n';
  }

  std::ostream& out_;
  SensorComments comments_; ///< those not yet written
  std::string section_;
};

/// Quoted where YAML would take the word for something else.
std::string
yamlText(const std::string& word)
{
  YAML::Emitter emitter;
  emitter << word;
  return emitter.c_str();
}

void
writePattern(SectionWriter& out, const Sensor& sensor)
{
  std::vector<std::string> maps;
  for (const PatternWave& wave : sensor.pattern.waves)
    maps.push_back(fmt::format("{}: {}, length_px: {}, shape: {}",
                               patternSigmaName(*sensor.noise),
                               wave.sigma,
                               wave.length_px,
                               kPatternShapeNames.of(wave.shape)));
  if (!maps.empty())
    out.list("pattern", maps);
}

void
writeSensor(SectionWriter& out,
            const Sensor& sensor,
            const NoiseParameters& noise,
            const std::string& map_file)
{
  out.entry("name", yamlText(sensor.name));
  out.begin("camera");
  out.entry("width", sensor.camera.width);
  out.entry("height", sensor.camera.height);
  out.entry("fx", sensor.camera.fx);
  out.entry("fy", sensor.camera.fy);
  out.entry("cx", sensor.camera.cx);
  out.entry("cy", sensor.camera.cy);
  out.begin("range");
  out.entry("min_m", sensor.min_range_m);
  out.entry("max_m", sensor.max_range_m);
  out.begin("disparity");
  out.entry("baseline_m", sensor.baseline_m);
  out.entry("focal_px", sensor.disparity_focal_px);
  if (sensor.disparity_quantum_px > 0.0)
    out.entry("quantum_px", sensor.disparity_quantum_px);
  out.begin("noise");
  out.entry("model", sensor.noise->name());
  for (const auto& [name, value] : noise)
    out.entry(name, value);
  writePattern(out, sensor);
  if (!map_file.empty())
    out.entry("pattern_map", yamlText(map_file));
  out.finish();
}

} // namespace

Sensor
loadSensor(const std::string& name_or_path)
{
  const std::string file = io::findBuiltIn("sensor", "sensors", name_or_path);
  return readSensor(io::loadYaml(file));
}

void
saveSensor(const std::string& path,
           const Sensor& sensor,
           const NoiseParameters& noise,
           const SensorComments& comments,
           const std::string& map_file)
{
  const NoiseModel::ConstPtr model = // throws when they do not match
      makeNoiseModel(sensor.noise->name(), noise);
  if (const std::string error = validityError(sensor.pattern); !error.empty())
    throw std::invalid_argument(error);
  if (const std::string excess = excessOf(sensor.pattern, *model); !excess.empty())
    throw std::invalid_argument("pattern " + excess);
  if (map_file.empty() != !sensor.pattern_map)
    throw std::invalid_argument("a pattern map and its file go together");
  AtomicFile file(path);
  SectionWriter out(file.stream(), comments);
  writeSensor(out, sensor, noise, map_file);
  file.commit();
}

std::vector<std::string>
listSensors()
{
  return io::listBuiltIn("sensors");
}

} // namespace holdfast
