#include "ros1/parameters.h"

#include <holdfast/HoldfastConfig.h>
#include <holdfast/enum_names.h>
#include <holdfast/fit/names.h>
#include <holdfast/io/names.h>

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

namespace holdfast::robot {
namespace {

constexpr EnumNames<Input, 2> kInputNames{{"cloud", "depth"}};

/// Of cfg/Holdfast.cfg, which dynamic_reconfigure reads.
bool
isDynamic(const std::string& name)
{
  const auto& parameters = ::holdfast::HoldfastConfig::__getParamDescriptions__();
  return std::any_of(parameters.begin(), parameters.end(), [&](const auto& parameter) {
    return parameter->name == name;
  });
}

/// Reads parameters and remembers which.
class Reader {
public:
  explicit Reader(const ros::NodeHandle& node) : node_(node) {}

  template <typename Value>
  void read(const std::string& name, Value& value)
  {
    known_.insert(name);
    if (node_.hasParam(name) && !node_.getParam(name, value))
      throw std::runtime_error("parameter " + name + " has the wrong type");
  }

  template <typename Names, typename Enum>
  void readName(const std::string& name, const Names& names, Enum& value)
  {
    std::string word(names.of(value));
    read(name, word);
    const auto found = names.find(word);
    if (!found)
      throw std::runtime_error(fmt::format("parameter {}: '{}' is none of: {}",
                                           name,
                                           word,
                                           fmt::join(names.words, " ")));
    value = *found;
  }

  void readSeconds(const std::string& name, std::chrono::duration<double>& value)
  {
    double seconds = value.count();
    read(name, seconds);
    if (!(std::isfinite(seconds) && seconds >= 0.0))
      throw std::runtime_error("parameter " + name + " must not be negative");
    value = std::chrono::duration<double>(seconds);
  }

  /// A name that is misspelt would go unheard.
  void requireNoOther() const
  {
    std::vector<std::string> names;
    node_.getParamNames(names);
    const std::string own = node_.getNamespace() + "/";
    for (const std::string& name : names)
      if (name.rfind(own, 0) == 0) {
        const std::string word = name.substr(own.size());
        if (known_.count(word) == 0 && !isDynamic(word))
          throw std::runtime_error("there is no parameter " + word);
      }
  }

private:
  const ros::NodeHandle& node_;
  std::set<std::string> known_;
};

std::optional<Eigen::Vector3d>
readDirection(Reader& reader, const std::string& name)
{
  std::vector<double> numbers;
  reader.read(name, numbers);
  if (numbers.empty())
    return std::nullopt;
  if (numbers.size() != 3)
    throw std::runtime_error("parameter " + name + " has three numbers");
  return Eigen::Vector3d(numbers[0], numbers[1], numbers[2]);
}

void
readSettings(Reader& reader, Settings& settings)
{
  reader.read("sensor", settings.sensor);
  reader.read("pattern", settings.pattern);
  reader.read("sensor_frame", settings.sensor_frame);
  reader.readName("axes", kCloudAxesNames, settings.axes);
  reader.readName("surface", kSurfaceRequestNames, settings.surface);
  reader.read("threads", settings.threads);
  reader.read("map", settings.map);
  reader.read("odometry_frame", settings.odometry_frame);
  reader.read("map_frame", settings.map_frame);
  reader.read("motion_sigma_rad", settings.motion_sigma_rad);
  reader.read("motion_sigma_m", settings.motion_sigma_m);
  reader.read("foot", settings.foot);
  settings.load_direction = readDirection(reader, "load_direction");
  reader.read("grid_resolution", settings.grid_resolution_m);
  reader.read("yaws", settings.yaws);
  reader.read("foothold_spacing", settings.foothold_spacing_m);
  reader.read("max_footholds", settings.max_footholds);
}

} // namespace

NodeParameters
readParameters(const ros::NodeHandle& own)
{
  NodeParameters parameters;
  Reader reader(own);
  readSettings(reader, parameters.settings);
  reader.readName("input", kInputNames, parameters.input);
  reader.read("queue", parameters.queue);
  if (parameters.queue < 1)
    throw std::runtime_error("parameter queue must be at least 1");
  reader.readSeconds("transform_timeout", parameters.transform_timeout);
  reader.readSeconds("warning_period", parameters.warning_period);
  reader.read("ellipsoid_sigmas", parameters.markers.sigmas);
  reader.read("ellipsoid_scale", parameters.markers.scale);
  reader.requireNoOther();
  return parameters;
}

} // namespace holdfast::robot
