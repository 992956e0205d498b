// What touches the surface.
#include "bindings.h"

#include "arrays.h"
#include "foot_object.h"
#include "keywords.h"
#include "package_files.h"

#include <holdfast/contact/names.h>
#include <holdfast/io/foot_file.h>

#include <pybind11/stl.h>

#include <algorithm>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

namespace holdfast::python {

const Foot&
footOf(py::handle object)
{
  if (!py::isinstance<FootObject>(object))
    throw py::type_error("foot: a holdfast.Foot is needed, not " + kindText(object));
  return object.cast<const FootObject&>().foot;
}

namespace {

const Keywords<Foot>&
footKeywords()
{
  static const Keywords<Foot> keywords = [] {
    const auto limit = [](auto member) {
      return [member](Foot& f) -> double& { return f.tolerances.*member; };
    };
    using T = ContactTolerances;
    Keywords<Foot> k("Foot.make");
    k.add(
         "ankle",
         kAnkleNames,
         [](Foot& f) -> Ankle& { return f.ankle; },
         "compliant: the sole turns until it lies on the surface; stiff: it keeps the "
         "orientation that was planned.")
        .add(
            "friction",
            [](Foot& f) -> double& { return f.friction.mean; },
            "mean of the coefficient, which is lognormal.")
        .add(
            "friction_sigma",
            [](Foot& f) -> double& { return f.friction.sigma; },
            "its standard deviation; 0: known exactly.")
        .add("height_m",
             limit(&T::height_m),
             "tolerance: of the surface along the load off the planned point, m.")
        .add("tilt_rad",
             limit(&T::tilt_rad),
             "tolerance: of the surface against a stiff ankle's sole, rad.")
        .add("gap_m",
             limit(&T::gap_m),
             "tolerance: of the surface from the sole that lies on it, m.")
        .add("contact_m",
             limit(&T::contact_m),
             "nearer than this the surface counts as in contact, m.")
        .add("min_support",
             limit(&T::min_support),
             "share of the sole that has to be over surface that was seen.");
    return k;
  }();
  return keywords;
}

/// (length, width), or corners (N, 2).
std::vector<Eigen::Vector2d>
soleOf(py::handle object)
{
  const Numbers array = numbers(object, "sole");
  if (array.ndim() == 1 && array.shape(0) == 2) {
    if (!(array.at(0) > 0.0 && array.at(1) > 0.0))
      throw py::value_error("sole: length and width must be positive");
    return rectangularFoot(array.at(0), array.at(1)).sole;
  }
  if (array.ndim() != 2 || array.shape(1) != 2)
    failShape("sole", "(2,) of length and width, or (N, 2) of corners,", array);
  std::vector<Eigen::Vector2d> corners;
  for (py::ssize_t i = 0; i < array.shape(0); ++i)
    corners.emplace_back(array.at(i, 0), array.at(i, 1));
  return corners;
}

Eigen::Vector2d
curvatureOf(py::handle object)
{
  const Numbers array = numbers(object, "curvature");
  if (array.ndim() != 1 || array.shape(0) != 2)
    failShape("curvature", "(2,)", array);
  return {array.at(0), array.at(1)};
}

FootObject
makeFoot(const py::object& sole,
         const py::object& name,
         const py::object& curvature,
         const py::kwargs& given)
{
  FootObject made;
  made.foot.name = readText("name", name);
  made.foot.sole = soleOf(sole);
  made.foot.curvature = curvatureOf(curvature);
  footKeywords().set(made.foot, given);
  if (const std::string error = validityError(made.foot); !error.empty())
    throw py::value_error(error);
  return made;
}

FootObject
loadFootFile(const py::object& name_or_path)
{
  const py::object path = py::module_::import("os").attr("fspath")(name_or_path);
  const std::string name = readText("name_or_path", path);
  try {
    return {loadFoot(foundInPackage("feet", listFeet(), name))};
  }
  catch (const std::runtime_error& error) {
    throw py::value_error(error.what());
  }
}

py::array
soleArray(const FootObject& self)
{
  const auto corners = static_cast<py::ssize_t>(self.foot.sole.size());
  auto out = newArray<double>({corners, 2});
  double* to = out.mutable_data();
  for (const Eigen::Vector2d& corner : self.foot.sole)
    to = std::copy_n(corner.data(), 2, to);
  return std::move(out);
}

using FootClass = py::class_<FootObject, std::shared_ptr<FootObject>>;

void
bindMaking(FootClass& type)
{
  type.def_static(
          "load",
          loadFootFile,
          py::arg("name_or_path"),
          "load(name_or_path) -> Foot\n\n"
          "A foot from a YAML file, or a built-in one by its name (Foot.names()).\n"
          "config/feet/humanoid_foot.yaml explains the keys. ValueError with file, "
          "line\nand key where there is no such foot or something is wrong in the "
          "file.")
      .def_static(
          "names",
          [] { return builtInNames("feet", listFeet()); },
          "names() -> list of str\n\nBuilt-in feet.")
      .def_static(
          "make",
          makeFoot,
          py::arg("sole"),
          py::kw_only(),
          py::arg("name") = "foot",
          py::arg("curvature") = py::make_tuple(0.0, 0.0),
          ("make(sole, *, name='foot', curvature=(0.0, 0.0), " +
           footKeywords().signature() +
           ") -> Foot\n\n"
           "    >>> holdfast.Foot.make((0.2, 0.1), friction=0.7, gap_m=0.01)\n\n"
           "sole: (length, width) along x and y, m, with the load in the middle, or "
           "corners\n    (N, 2), m, in order, with the load at (0, 0).\n"
           "curvature: (2,) of the sole along x and y, 1/m; positive like a ball's "
           "that\n    lies on the ground.\n" +
           footKeywords().help() +
           "TypeError for an option there is not, ValueError for what makes no sense.")
              .c_str());
}

void
bindShape(FootClass& type)
{
  type.def_property_readonly(
          "name",
          [](const FootObject& f) { return f.foot.name; },
          "Name.")
      .def_property_readonly("sole",
                             soleArray,
                             "(N, 2) corners, m, in the frame of the sole.")
      .def_property_readonly(
          "curvature",
          [](const FootObject& f) { return toArray(f.foot.curvature); },
          "(2,) of the sole along its x and y, 1/m.")
      .def_property_readonly(
          "area",
          [](const FootObject& f) { return soleArea(f.foot); },
          "m^2.")
      .def_property_readonly(
          "reach",
          [](const FootObject& f) { return soleReach(f.foot); },
          "Distance of the farthest corner from the load, m: patches must be known "
          "that\nfar.");
}

void
bindLimits(FootClass& type)
{
  type.def_property_readonly(
          "ankle",
          [](const FootObject& f) { return std::string(kAnkleNames.of(f.foot.ankle)); },
          "'compliant' or 'stiff'.")
      .def_property_readonly(
          "friction",
          [](const FootObject& f) {
            return py::make_tuple(f.foot.friction.mean, f.foot.friction.sigma);
          },
          "(mean, standard deviation) of the coefficient, which is lognormal.")
      .def_property_readonly(
          "tolerances",
          [](const FootObject& f) {
            const ContactTolerances& t = f.foot.tolerances;
            py::dict out;
            out["height_m"] = t.height_m;
            out["tilt_rad"] = t.tilt_rad;
            out["gap_m"] = t.gap_m;
            out["contact_m"] = t.contact_m;
            out["min_support"] = t.min_support;
            return out;
          },
          "dict of `height_m`, `tilt_rad`, `gap_m`, `contact_m`, `min_support`.");
}

} // namespace

void
bindFoot(py::module_& module)
{
  FootClass type(
      module,
      "Foot",
      "What touches the surface: a sole or finger pad, its ankle, its friction, and "
      "what\nit may bear. Made by Foot.load() or Foot.make(); it does not change.\n\n"
      "Frame of the sole: origin where the load acts, x forward, z out of the "
      "surface,\ninto the leg.");
  bindMaking(type);
  bindShape(type);
  bindLimits(type);
  type.def("__repr__", [](const FootObject& f) {
    return "<holdfast.Foot: " + f.foot.name + ", " +
           std::string(kAnkleNames.of(f.foot.ankle)) + ">";
  });
}

} // namespace holdfast::python
