// Sensors: where they come from, and what they say.
#include "bindings.h"

#include "arrays.h"
#include "keywords.h"
#include "package_files.h"
#include "sensor_object.h"

#include <holdfast/io/config.h>
#include <holdfast/sensor/names.h>

#include <pybind11/stl.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace holdfast::python {
namespace {

SensorObject
load(const py::object& name_or_path)
{
  const py::object path = py::module_::import("os").attr("fspath")(name_or_path);
  const std::string name = readText("name_or_path", path);
  try {
    return SensorObject(loadSensor(foundInPackage("sensors", listSensors(), name)));
  }
  catch (const std::runtime_error& error) {
    throw py::value_error(error.what());
  }
}

/// What make() is told, noise parameters aside.
struct Description {
  Sensor sensor;
  double focal_px = 580.0;
};

const Keywords<Description>&
cameraKeywords()
{
  static const Keywords<Description> keywords = [] {
    const auto camera = [](auto member) {
      return [member](Description& d) -> decltype(auto) {
        return (d.sensor.camera.*member);
      };
    };
    const auto sensor = [](auto member) {
      return [member](Description& d) -> decltype(auto) { return (d.sensor.*member); };
    };
    Keywords<Description> k("Sensor.make");
    k.add("width", camera(&Camera::width), "of the image, px.")
        .add("height", camera(&Camera::height), "of the image, px.")
        .add("fx", camera(&Camera::fx), "focal length, px.")
        .add("fy", camera(&Camera::fy), "focal length, px.")
        .add("cx", camera(&Camera::cx), "principal point, px.")
        .add("cy", camera(&Camera::cy), "principal point, px.")
        .add("min_range_m", sensor(&Sensor::min_range_m), "nearest depth, m.")
        .add("max_range_m", sensor(&Sensor::max_range_m), "furthest depth, m.")
        .add("baseline_m", sensor(&Sensor::baseline_m), "of the stereo geometry, m.")
        .add(
            "focal_px",
            [](Description& d) -> double& { return d.focal_px; },
            "of the image in which disparity is measured, px.")
        .add("disparity_quantum_px",
             sensor(&Sensor::disparity_quantum_px),
             "step of the disparity, px; 0: none.");
    return k;
  }();
  return keywords;
}

/// [(sigma, length_px, shape), ...]
NoisePattern
patternOf(const py::object& waves)
{
  NoisePattern pattern;
  if (waves.is_none())
    return pattern;
  for (const py::handle& item : waves) {
    if (!py::isinstance<py::sequence>(item) || py::len(item) != 3)
      throw py::type_error("pattern: each wave is (sigma, length_px, shape)");
    const auto wave = py::reinterpret_borrow<py::sequence>(item);
    PatternWave out;
    read("pattern: sigma", wave[0], out.sigma);
    read("pattern: length_px", wave[1], out.length_px);
    out.shape = readWord(kPatternShapeNames, "pattern: shape", wave[2]);
    pattern.waves.push_back(out);
  }
  if (const std::string error = validityError(pattern); !error.empty())
    throw py::value_error("pattern: " + error);
  return pattern;
}

void
requireCamera(const Sensor& sensor)
{
  const Camera& c = sensor.camera;
  const auto isPositive = [](double x) { return std::isfinite(x) && x > 0.0; };
  if (c.width < 1 || c.height < 1)
    throw py::value_error("width and height: both must be at least 1 px");
  if (!isPositive(c.fx) || !isPositive(c.fy) || !std::isfinite(c.cx + c.cy))
    throw py::value_error("fx, fy, cx and cy: focal lengths must be positive, and all "
                          "finite");
  if (!(sensor.min_range_m >= 0.0 && sensor.max_range_m > sensor.min_range_m))
    throw py::value_error("min_range_m and max_range_m: 0 <= min < max is needed");
  if (!isPositive(sensor.baseline_m) || !isPositive(sensor.disparity_focal_px) ||
      !(sensor.disparity_quantum_px >= 0.0))
    throw py::value_error(
        "baseline_m, focal_px and disparity_quantum_px: the first two "
        "must be positive, the third not negative");
}

/// The pattern is a part of the noise of a single point.
void
requireRoomFor(const NoisePattern& pattern,
               const NoiseModel& noise,
               const NoiseParameters& parameters)
{
  constexpr double kSlack = 1.0 + 1e-9; // sums of decimals
  double whole = noise.covariance(Eigen::Vector3d::UnitZ())(2, 2);
  if (noise.name() == "stereo")
    whole = std::pow(parameters.at("sigma_disparity_px"), 2);
  if (pattern.variance() > kSlack * whole)
    throw py::value_error("pattern: its sigma (" + show(std::sqrt(pattern.variance())) +
                          ") is more than that of a single point (" +
                          show(std::sqrt(whole)) + "), of which it is a part");
}

SensorObject
make(const py::object& the_model,
     const py::object& the_name,
     const py::object& pattern,
     const py::kwargs& given)
{
  const std::string model = readText("model", the_model);
  const NoiseModelKind* kind = findNoiseModelKind(model);
  if (kind == nullptr) {
    std::vector<std::string> known;
    for (const NoiseModelKind& each : noiseModelKinds())
      known.push_back(each.name);
    failWord("model", model, known);
  }
  Description description;
  py::kwargs rest;
  NoiseParameters parameters;
  for (const auto& [key, value] : given) {
    const auto word = py::cast<std::string>(key);
    const bool is_parameter = kind->has(word);
    if (is_parameter)
      read(word, value, parameters[word]);
    if (!is_parameter || word == "baseline_m" || word == "focal_px")
      rest[key] = value;
  }
  cameraKeywords().set(description, rest);
  Sensor& sensor = description.sensor;
  sensor.disparity_focal_px = description.focal_px;
  sensor.name = readText("name", the_name);
  if (kind->has("baseline_m"))
    parameters["baseline_m"] = sensor.baseline_m;
  if (kind->has("focal_px"))
    parameters["focal_px"] = description.focal_px;
  requireCamera(sensor);
  sensor.noise = makeNoiseModel(model, parameters);
  sensor.pattern = patternOf(pattern);
  requireRoomFor(sensor.pattern, *sensor.noise, parameters);
  return SensorObject(sensor);
}

/// NaN where the model has none.
void
modelCovariances(const NoiseModel& noise,
                 const std::vector<Eigen::Vector3d>& points,
                 double* out)
{
  const bool everywhere = noise.isOmnidirectional();
  for (const Eigen::Vector3d& q : points) {
    const bool has_one = q.allFinite() && (everywhere ? !q.isZero(0.0) : q.z() > 0.0);
    const Eigen::Matrix3d S =
        has_one ? noise.covariance(q) :
                  Eigen::Matrix3d::Constant(std::numeric_limits<double>::quiet_NaN());
    out = std::copy_n(S.data(), 9, out); // symmetric: the order does not matter
  }
}

py::array
covariancesOf(const SensorObject& self, const py::object& points)
{
  const Numbers rows = numbers(points, "points");
  const bool is_image = rows.ndim() == 3;
  if ((rows.ndim() != 2 && !is_image) || rows.shape(rows.ndim() - 1) != 3)
    failShape("points", "(N, 3) or (H, W, 3)", rows);
  std::vector<py::ssize_t> shape(rows.shape(), rows.shape() + rows.ndim());
  shape.push_back(3);
  py::array_t<double> out(shape);
  double* to = out.mutable_data();
  const py::gil_scoped_release release;
  std::vector<Eigen::Vector3d> all(static_cast<std::size_t>(rows.size() / 3));
  for (std::size_t i = 0; i < all.size(); ++i)
    all[i] = Eigen::Map<const Eigen::Vector3d>(rows.data() + 3 * i);
  const NoiseModel& noise = *self.sensor().noise;
  if (is_image && noise.dependsOnNeighbors()) {
    const auto image = noise.imageCovariances(all,
                                              static_cast<int>(rows.shape(1)),
                                              static_cast<int>(rows.shape(0)));
    for (const Eigen::Matrix3f& S : image)
      to = std::copy_n(S.data(), 9, to);
  }
  else {
    modelCovariances(noise, all, to);
  }
  return std::move(out);
}

py::array
pointsOfDepth(const SensorObject& self, const py::object& depth)
{
  const Numbers image = numbers(depth, "depth");
  const Camera& camera = self.sensor().camera;
  if (image.ndim() != 2 || image.shape(0) != camera.height ||
      image.shape(1) != camera.width)
    failShape("depth",
              ("(" + std::to_string(camera.height) + ", " +
               std::to_string(camera.width) + ") of the sensor's image")
                  .c_str(),
              image);
  auto out = newArray<double>({camera.height, camera.width, 3});
  double* to = out.mutable_data();
  const double* from = image.data();
  for (int v = 0; v < camera.height; ++v)
    for (int u = 0; u < camera.width; ++u, ++from) {
      const double z = *from > 0.0 ? *from : std::numeric_limits<double>::quiet_NaN();
      to = std::copy_n(camera.backProject(u, v, z).data(), 3, to);
    }
  return std::move(out);
}

py::array
matrixOf(const SensorObject& self)
{
  const Camera& c = self.sensor().camera;
  Eigen::Matrix3d K;
  K << c.fx, 0.0, c.cx, 0.0, c.fy, c.cy, 0.0, 0.0, 1.0;
  return toArray(K);
}

py::list
wavesOf(const SensorObject& self)
{
  py::list out;
  for (const PatternWave& wave : self.sensor().pattern.waves)
    out.append(py::make_tuple(wave.sigma,
                              wave.length_px,
                              std::string(kPatternShapeNames.of(wave.shape))));
  return out;
}

using SensorClass = py::class_<SensorObject, std::shared_ptr<SensorObject>>;

void
bindMaking(SensorClass& type)
{
  type.def_static(
          "load",
          load,
          py::arg("name_or_path"),
          "load(name_or_path) -> Sensor\n\n"
          "A sensor from a YAML file, or a built-in one by its name (Sensor.names()).\n"
          "config/sensors/kinect_v1.yaml explains the keys. ValueError with file, "
          "line\n"
          "and key where there is no such sensor or something is wrong in the file.")
      .def_static(
          "names",
          [] { return builtInNames("sensors", listSensors()); },
          "names() -> list of str\n\nBuilt-in sensors.")
      .def_static(
          "make",
          make,
          py::arg("model"),
          py::kw_only(),
          py::arg("name") = "sensor",
          py::arg("pattern") = py::none(),
          ("make(model, *, name='sensor', pattern=None, **parameters) -> Sensor\n\n"
           "A sensor from a noise model and its parameters.\n\n"
           "    >>> holdfast.Sensor.make('constant', sigma_m=0.001, "
           "sigma_lateral_m=0.001)\n\n"
           "model: 'stereo' (sigma_point_px, sigma_disparity_px), 'constant' "
           "(sigma_m,\n"
           "    sigma_lateral_m), 'linear' (sigma_m, sigma_per_m, sigma_lateral_rad),\n"
           "    'quadratic' (sigma_m, sigma_per_m2, sigma_lateral_rad), 'khoshelham'\n"
           "    (sigma_z_per_m2, sigma_point_px) or 'dryanovski' (the same).\n"
           "pattern: what neighbouring pixels share of it, [(sigma, length_px, "
           "shape)],\n"
           "    sigma in px of disparity (stereo) or m at 1 m, shape 'exponential' or\n"
           "    'gaussian'.\n"
           "parameters: those of the model, and of the camera:\n" +
           cameraKeywords().help() +
           "TypeError for a parameter there is not, ValueError for one that makes no "
           "sense.")
              .c_str())
      .def(
          "without_pattern",
          [](const SensorObject& self) {
            return SensorObject(withoutPattern(self.sensor()));
          },
          "without_pattern() -> Sensor\n\n"
          "The same, with the errors of neighbouring pixels independent.");
}

void
bindCamera(SensorClass& type)
{
  type.def_property_readonly(
          "name",
          [](const SensorObject& s) { return s.sensor().name; },
          "Name.")
      .def_property_readonly(
          "model",
          [](const SensorObject& s) { return s.sensor().noise->name(); },
          "Name of the noise model.")
      .def_property_readonly(
          "pattern",
          wavesOf,
          "What neighbouring pixels share: [(sigma, length_px, shape)].")
      .def_property_readonly(
          "size",
          [](const SensorObject& s) {
            return py::make_tuple(s.sensor().camera.height, s.sensor().camera.width);
          },
          "(height, width) of the image, px.")
      .def_property_readonly("camera_matrix", matrixOf, "(3, 3) K of the camera, px.")
      .def_property_readonly(
          "range_m",
          [](const SensorObject& s) {
            return py::make_tuple(s.sensor().min_range_m, s.sensor().max_range_m);
          },
          "(nearest, furthest) depth the sensor delivers, m.");
}

} // namespace

void
bindSensor(py::module_& module)
{
  SensorClass type(
      module,
      "Sensor",
      "A depth camera: its pixels and the noise of its measurements.\n\n"
      "    >>> sensor = holdfast.Sensor.load('kinect_v1')\n"
      "    >>> sensor.covariances(points)                  # (N, 3, 3), m^2\n\n"
      "Frame of the camera: x right, y down, z forward, m.");
  bindMaking(type);
  bindCamera(type);
  type.def(
          "covariances",
          covariancesOf,
          py::arg("points"),
          "covariances(points) -> (..., 3, 3) float64\n\n"
          "Of the noise of points (N, 3) or an image (H, W, 3) in the camera's frame,\n"
          "m^2; NaN where the model says nothing: points that are not finite, or "
          "behind\n"
          "the camera. What neighbouring pixels share is in it, but not that they "
          "share\n"
          "it: fit(points, sensor=sensor) knows both.")
      .def("points",
           pointsOfDepth,
           py::arg("depth"),
           "points(depth) -> (H, W, 3) float64\n\n"
           "Points of a depth image (H, W), m along the optical axis, of the sensor's\n"
           "size; NaN where the depth is 0 or NaN.")
      .def("__repr__", [](const SensorObject& s) {
        return "<holdfast.Sensor: " + s.sensor().name + ", " +
               s.sensor().noise->name() + ">";
      });
  module.def("_set_package_folder",
             [](const std::string& folder) { packageFolder() = folder; });
}

} // namespace holdfast::python
