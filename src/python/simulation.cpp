// Simulated images.
#include "bindings.h"

#include "arrays.h"
#include "keywords.h"
#include "sensor_object.h"

#include <holdfast/simulation/scene.h>
#include <holdfast/simulation/simulator.h>
#include <holdfast/simulation/trajectory.h>

#include <pybind11/stl.h>

#include <memory>
#include <random>

namespace holdfast::python {
namespace {

struct SimulateOptions {
  SimulationOptions simulation;
  std::optional<double> distance;
  int stride = 1;
  std::uint64_t seed = 1;
};

const Keywords<SimulateOptions>&
simulateKeywords()
{
  static const Keywords<SimulateOptions> keywords = [] {
    Keywords<SimulateOptions> k("simulate");
    k.add(
         "seed",
         [](SimulateOptions& o) -> std::uint64_t& { return o.seed; },
         "of the noise; the same one gives the same image.")
        .add(
            "distance",
            [](SimulateOptions& o) -> std::optional<double>& { return o.distance; },
            "from the camera to the middle of the scene, m; None: the scene's own.")
        .add(
            "stride",
            [](SimulateOptions& o) -> int& { return o.stride; },
            "every so many pixels across and down.")
        .add(
            "noise_scale",
            [](SimulateOptions& o) -> double& { return o.simulation.noise_scale; },
            "factor on the noise's standard deviations; 0: none.")
        .add(
            "quantize",
            [](SimulateOptions& o) -> bool& { return o.simulation.quantize; },
            "round disparities to the sensor's step.");
    return k;
  }();
  return keywords;
}

/// In the frame of the camera, and where that stood in the scene.
struct SimulationObject {
  RangeImage image;
  Pose sensor_pose;
};

using SimulationClass = py::class_<SimulationObject, std::shared_ptr<SimulationObject>>;

/// The memory of the image, which stays as long as the array does.
py::array
viewOf(const py::object& self, const double* data, std::vector<py::ssize_t> inner)
{
  const RangeImage& image = self.cast<const SimulationObject&>().image;
  inner.insert(inner.begin(), {image.height, image.width});
  py::array_t<double> view(std::move(inner), data, self);
  view.attr("flags").attr("writeable") = false;
  return std::move(view);
}

SimulationObject
simulateScene(const py::object& scene,
              const py::object& sensor,
              const py::kwargs& given)
{
  const Sensor& seen_by = sensorOf(sensor);
  const std::string name = readText("scene", scene);
  SimulateOptions options;
  simulateKeywords().set(options, given);
  const py::gil_scoped_release release;
  std::mt19937_64 generator(options.seed);
  const Scene made = makeScene(name, options.distance);
  RangeImage image = simulate(made,
                              pixelRays(seen_by.camera, options.stride),
                              seen_by,
                              options.simulation,
                              generator);
  const Pose pose = image.sensor_pose;
  return {inSensorFrame(std::move(image)), pose};
}

py::array
drawOf(const SimulationObject& self, const py::object& seed)
{
  std::uint64_t number = 0;
  read("seed", seed, number);
  auto out = newArray<double>({self.image.height, self.image.width, 3});
  double* to = out.mutable_data();
  {
    const py::gil_scoped_release release;
    std::mt19937_64 generator(number);
    std::vector<Eigen::Vector3d> points;
    drawNoise(self.image, generator, points);
    for (const Eigen::Vector3d& q : points)
      to = std::copy_n(q.data(), 3, to);
  }
  return std::move(out);
}

void
bindSimulationType(py::module_& module)
{
  SimulationClass(
      module,
      "Simulation",
      "A simulated image (H, W) in the frame of its camera, m; NaN where a ray\n"
      "meets nothing. Its arrays are views of its memory, read-only.")
      .def_property_readonly(
          "points",
          [](const py::object& self) {
            return viewOf(self,
                          self.cast<const SimulationObject&>().image.points[0].data(),
                          {3});
          },
          "(H, W, 3) as measured.")
      .def_property_readonly(
          "truth",
          [](const py::object& self) {
            return viewOf(self,
                          self.cast<const SimulationObject&>().image.truth[0].data(),
                          {3});
          },
          "(H, W, 3) without noise.")
      .def_property_readonly(
          "covariances",
          [](const py::object& self) {
            return viewOf(
                self,
                self.cast<const SimulationObject&>().image.covariances[0].data(),
                {3, 3});
          },
          "(H, W, 3, 3) of the noise of single points, m^2, at the truth.")
      .def_property_readonly(
          "hits",
          [](const SimulationObject& self) {
            return keptArray(self.image.hits, {self.image.height, self.image.width});
          },
          "(H, W) number of the patch or shape of the scene that was met; -1: nothing.")
      .def_property_readonly(
          "sensor_pose",
          [](const SimulationObject& self) { return toArray(self.sensor_pose); },
          "(4, 4) of the camera in the scene.")
      .def(
          "draw",
          drawOf,
          py::arg("seed"),
          "draw(seed) -> (H, W, 3) float64\n\n"
          "The same image with other noise (not rounded); far cheaper than simulate().")
      .def("__repr__", [](const SimulationObject& self) {
        return "<holdfast.Simulation: " + std::to_string(self.image.height) + " x " +
               std::to_string(self.image.width) + ">";
      });
}

} // namespace

void
bindSimulation(py::module_& module)
{
  bindSimulationType(module);
  module.def(
      "simulate",
      simulateScene,
      py::arg("scene"),
      py::arg("sensor"),
      documented("simulate(scene, sensor, *, " + simulateKeywords().signature() + ")",
                 "An image of a scene as a sensor would measure it.\n"
                 "\n"
                 "    >>> sensor = holdfast.Sensor.load('kinect_v1')\n"
                 "    >>> image = holdfast.simulate('rocks', sensor, stride=4)\n"
                 "    >>> patches = holdfast.extract(image.points, sensor)\n"
                 "\n"
                 "Arguments\n"
                 "    scene: a name of scene_names(): a type of patch, 'rocks',\n"
                 "        'stairs', 'table', ...\n"
                 "    sensor: a Sensor: its pixels, its noise, what pixels share.\n" +
                     simulateKeywords().help() +
                     "\n"
                     "Returns\n"
                     "    a Simulation, in the frame of the camera.\n"
                     "\n"
                     "Raises\n"
                     "    TypeError, ValueError: as extract(), in words.\n"
                     "\n"
                     "The interpreter's lock is released while it computes.")
          .c_str());
  module.def("scene_names",
             sceneNames,
             "scene_names() -> list of str\n\nScenes that simulate() knows.");
}

} // namespace holdfast::python
