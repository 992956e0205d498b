// Patches over time.
#include "bindings.h"

#include "arrays.h"
#include "cloud.h"
#include "extract_keywords.h"
#include "patch_map_object.h"
#include "patch_objects.h"
#include "sensor_object.h"

#include <holdfast/geometry/gaussian.h>
#include <holdfast/io/patch_map_file.h>

#include <algorithm>
#include <optional>
#include <stdexcept>
#include <utility>

namespace holdfast::python {

const PatchMapObject&
mapOf(py::handle object)
{
  if (!py::isinstance<PatchMapObject>(object))
    throw py::type_error("patch_map: a holdfast.PatchMap is needed, not " +
                         kindText(object));
  return object.cast<const PatchMapObject&>();
}

namespace {

struct MapRequest {
  ExtractionOptions extraction;
  PatchMapOptions map;
};

const Keywords<MapRequest>&
mapKeywords()
{
  static const Keywords<MapRequest> keywords = [] {
    const auto of = [](auto member) {
      return [member](MapRequest& r) -> decltype(auto) { return (r.map.*member); };
    };
    using O = PatchMapOptions;
    Keywords<MapRequest> k("PatchMap");
    k.add("gate_level",
          of(&O::gate_level),
          "probability of refusing a measurement that belongs to its patch.")
        .add("association_radius",
             of(&O::association_radius),
             "how far a measurement may be from its patch, in radii.")
        .add("max_uncertainty_rad",
             of(&O::max_uncertainty_rad),
             "a less certain normal tells too little to be fused, rad.")
        .add("max_views",
             of(&O::max_views),
             "independent views after which others replace what is known.")
        .add("min_radius_m", of(&O::min_radius_m), "of patches that were split, m.")
        .add("volume_radius_m",
             of(&O::volume_radius_m),
             "patches further from the sensor are forgotten, m.");
    addExtractionOptions(k, [](MapRequest& r) -> ExtractionOptions& {
      return r.extraction;
    });
    return k;
  }();
  return keywords;
}

MappingOptions
mappingOptionsOf(const Sensor& sensor, const py::kwargs& given)
{
  MapRequest request;
  mapKeywords().set(request, given);
  request.map.radius_m = request.extraction.sampler.radius_m;
  request.map.min_radius_m = std::min(request.map.min_radius_m, request.map.radius_m);
  MappingOptions options = mappingOptionsFor(sensor, request.extraction);
  options.map = mapOptionsFor(sensor, request.map);
  return options;
}

/// (6, 6), about (delta, c).
JetMatrix
motionCovariance(py::handle object)
{
  const Numbers array = numbers(object, "covariance");
  if (array.ndim() != 2 || array.shape(0) != 6 || array.shape(1) != 6)
    failShape("covariance", "(6, 6)", array);
  const JetMatrix S = Eigen::Map<const JetMatrix>(array.data());
  if (S.isZero(0.0))
    throw py::value_error("covariance: it is zero: nobody knows a motion exactly");
  if (!isPositiveSemiDefinite(S))
    throw py::value_error(
        "covariance: it is none: not finite, not symmetric, or with a "
        "negative eigenvalue");
  return S;
}

void
moveMap(PatchMapObject& self, const py::object& increment, const py::object& covariance)
{
  const Motion next{poseOf(increment, "increment"), motionCovariance(covariance)};
  const py::gil_scoped_release release;
  self.move(next);
}

py::dict
dictOf(const FrameReport& report)
{
  const UpdateReport& u = report.update;
  py::dict out;
  out["measurements"] = report.measurements;
  out["asked"] = report.asked;
  out["hidden"] = report.hidden;
  out["fused"] = u.fused;
  out["born"] = u.born;
  out["gated"] = u.gated;
  out["replaced"] = u.replaced;
  out["surplus"] = u.surplus;
  out["uncertain"] = u.uncertain;
  out["unfit"] = u.unfit;
  out["seen_through"] = u.seen_through;
  out["merged"] = u.merged;
  out["split"] = u.split;
  out["forgotten"] = u.forgotten;
  out["pose_found"] = report.registration ?
                          py::object(py::bool_(report.registration->status ==
                                               RegistrationStatus::Converged)) :
                          py::object(py::none());
  return out;
}

py::dict
updateMap(PatchMapObject& self, const py::object& points, const py::object& find_pose)
{
  bool finds = false;
  read("find_pose", find_pose, finds);
  const RangeCloud frame = cloudOf(points, py::none(), py::none());
  return dictOf(self.update(frame, finds));
}

std::string
pathOf(const py::object& path)
{
  return readText("path", py::module_::import("os").attr("fspath")(path));
}

void
saveMap(const PatchMapObject& self, const py::object& path)
{
  try {
    self.save(pathOf(path));
  }
  catch (const std::runtime_error& error) {
    PyErr_SetString(PyExc_OSError, error.what());
    throw py::error_already_set();
  }
}

std::shared_ptr<PatchMapObject>
loadMap(const py::object& path, const py::object& sensor, const py::kwargs& given)
{
  const Sensor& seen_by = sensorOf(sensor);
  StoredMap stored;
  try {
    stored = loadPatchMap(pathOf(path));
  }
  catch (const std::runtime_error& error) {
    throw py::value_error(error.what());
  }
  if (stored.sensor != seen_by.name)
    throw py::value_error("sensor: the map is of " + stored.sensor + ", not of " +
                          seen_by.name);
  return std::make_shared<PatchMapObject>(seen_by,
                                          mappingOptionsOf(seen_by, given),
                                          std::move(stored.map));
}

std::string
mapHelp()
{
  return documented(
      "PatchMap(sensor, *, " + mapKeywords().signature() + ")",
      "Patches over time: what several frames of a moving camera see is fused.\n"
      "\n"
      "    >>> patch_map = holdfast.PatchMap(sensor, radius_m=0.05)\n"
      "    >>> for image, increment, covariance in frames:\n"
      "    ...     patch_map.move(increment, covariance)        # not before the "
      "first\n"
      "    ...     patch_map.update(image)\n"
      "    >>> patch_map.patches.centre                         # frame of the map\n"
      "\n"
      "The map's frame is the camera's at first. Covariances are those of where "
      "patches\n"
      "lie from the sensor now. What is fitted are paraboloids, whatever `surface` "
      "says;\n"
      "`patches` have the types that the fused curvatures tell.\n"
      "\n"
      "sensor: a Sensor.\n" +
          mapKeywords().help());
}

using MapClass = py::class_<PatchMapObject, std::shared_ptr<PatchMapObject>>;

void
bindMoving(MapClass& type)
{
  type.def(py::init([](const py::object& sensor, const py::kwargs& given) {
             const Sensor& seen_by = sensorOf(sensor);
             return std::make_shared<PatchMapObject>(seen_by,
                                                     mappingOptionsOf(seen_by, given));
           }),
           py::arg("sensor"))
      .def("move",
           moveMap,
           py::arg("increment"),
           py::arg("covariance"),
           "move(increment, covariance) -> None\n\n"
           "The camera has moved before the next frame: `increment` (4, 4) is its new "
           "pose\n"
           "in its old frame, m; `covariance` (6, 6) that of (rotation in the new "
           "axes,\n"
           "rad, translation in the old axes, m). Several motions add up. ValueError "
           "for\n"
           "what is no rigid transform, or no covariance (zero is none).")
      .def("update",
           updateMap,
           py::arg("points"),
           py::kw_only(),
           py::arg("find_pose") = false,
           "update(points, *, find_pose=False) -> dict of counts\n\n"
           "Take the next frame (H, W, 3), m, camera's frame: of the pose that move()\n"
           "told, or the same as before; with find_pose=True the map itself finds it.\n"
           "The counts say what became of its measurements ('fused', 'born', 'gated', "
           "...)\n"
           "and of patches; 'pose_found' is None unless it was looked for.");
}

void
bindAsking(MapClass& type)
{
  type.def_property_readonly(
          "patches",
          [](const PatchMapObject& self) { return PatchesObject(self.patches()); },
          "Patches of the map as it is, in its frame.")
      .def_property_readonly(
          "pose",
          [](const PatchMapObject& self) {
            return toArray(self.ask([](const PatchMap& map) { return map.pose(); }));
          },
          "(4, 4) of the camera in the frame of the map, after the last update().")
      .def_property_readonly(
          "frames",
          [](const PatchMapObject& self) {
            return self.ask([](const PatchMap& map) { return map.frames(); });
          },
          "How many frames there were.")
      .def("__len__",
           [](const PatchMapObject& self) {
             return self.ask([](const PatchMap& map) { return map.patches().size(); });
           })
      .def("save",
           saveMap,
           py::arg("path"),
           "save(path) -> None\n\nWrite the map bit for bit; OSError where that fails.")
      .def_static(
          "load",
          loadMap,
          py::arg("path"),
          py::arg("sensor"),
          "load(path, sensor, **options) -> PatchMap\n\n"
          "A map that save() or `holdfast map` has written, to go on with. Options\n"
          "of the map are those it was made with. ValueError for what is none, or\n"
          "the map of another sensor.");
}

} // namespace

void
bindPatchMap(py::module_& module)
{
  const std::string help = mapHelp();
  MapClass type(module, "PatchMap", help.c_str());
  bindMoving(type);
  bindAsking(type);
}

} // namespace holdfast::python
