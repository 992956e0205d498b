// The risk of every cell of a grid over a map.
#include "bindings.h"

#include "arrays.h"
#include "contact_columns.h"
#include "foot_object.h"
#include "keywords.h"
#include "patch_map_object.h"

#include <holdfast/contact/risk_grid.h>

#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace holdfast::python {
namespace {

using GridClass = py::class_<RiskGrid, std::shared_ptr<RiskGrid>>;

/// (2, 2), or None.
std::optional<GridBounds>
boundsOf(py::handle object)
{
  if (object.is_none())
    return std::nullopt;
  const Numbers array = numbers(object, "bounds");
  if (array.ndim() != 2 || array.shape(0) != 2 || array.shape(1) != 2)
    failShape("bounds", "(2, 2) of the lowest x, y and the highest", array);
  return GridBounds{{array.at(0, 0), array.at(0, 1)}, {array.at(1, 0), array.at(1, 1)}};
}

const Keywords<RiskGridOptions>&
gridKeywords()
{
  static const Keywords<RiskGridOptions> keywords = [] {
    using O = RiskGridOptions;
    Keywords<RiskGridOptions> k("risk_grid");
    k.add("resolution_m", &O::resolution_m, "side of a cell, m.")
        .add("yaws",
             &O::yaws,
             "directions of the sole that are tried in every cell, over a turn.")
        .put(
            "bounds",
            [](O& o, py::handle value) { o.bounds = boundsOf(value); },
            [](O&) { return std::string("None"); },
            "(2, 2): lowest x and y, highest x and y, axes of the grid, m; None: what "
            "the map has seen.")
        .add("threads", &O::threads, "0: one for each core.");
    return k;
  }();
  return keywords;
}

std::shared_ptr<RiskGrid>
gridOf(const py::object& patch_map,
       const py::object& foot,
       const py::object& load_direction,
       const py::kwargs& given)
{
  const PatchMapObject& asked = mapOf(patch_map);
  const Foot& used = footOf(foot);
  RiskGridOptions options;
  options.load_direction = vectorOf(load_direction, "load_direction");
  gridKeywords().set(options, given);
  if (const std::string error = validityError(options); !error.empty())
    throw py::value_error(error);
  return asked.ask([&](const PatchMap& map) {
    return std::make_shared<RiskGrid>(riskGrid(map, used, options));
  });
}

/// The memory of a layer, which stays as long as the array does. A column's values
/// follow each other there.
py::array
layerView(const py::object& self, std::size_t layer)
{
  const auto& grid = self.cast<const RiskGrid&>();
  const auto step = static_cast<py::ssize_t>(sizeof(float));
  py::array_t<float> view(std::vector<py::ssize_t>{grid.rows, grid.columns},
                          std::vector<py::ssize_t>{step, step * grid.rows},
                          grid.data[layer].data(),
                          self);
  view.attr("flags").attr("writeable") = false;
  return std::move(view);
}

py::dict
layersOf(const py::object& self)
{
  py::dict out;
  const auto& names = self.cast<const RiskGrid&>().layers;
  for (std::size_t i = 0; i < names.size(); ++i)
    out[py::str(names[i])] = layerView(self, i);
  return out;
}

py::array
layerOf(const py::object& self, const py::object& name)
{
  const std::string wanted = readText("layer", name);
  const auto& names = self.cast<const RiskGrid&>().layers;
  for (std::size_t i = 0; i < names.size(); ++i)
    if (names[i] == wanted)
      return layerView(self, i);
  std::string known;
  for (const std::string& each : names)
    known += (known.empty() ? "" : ", ") + each;
  throw py::key_error("'" + wanted + "' is none of " + known);
}

/// Middles of the cells along one axis of the grid, m.
py::array
middles(const RiskGrid& grid, bool along_x)
{
  const int count = along_x ? grid.rows : grid.columns;
  auto out = newArray<double>({count});
  for (int i = 0; i < count; ++i)
    out.mutable_at(i) = along_x ? grid.position(i, 0).x() : grid.position(0, i).y();
  return std::move(out);
}

py::array
pointsOf(const RiskGrid& grid)
{
  auto out = newArray<double>({grid.rows, grid.columns, 3});
  double* to = out.mutable_data();
  for (int row = 0; row < grid.rows; ++row)
    for (int column = 0; column < grid.columns; ++column) {
      const Eigen::Vector3d point = grid.point(row, column);
      to = std::copy_n(point.data(), 3, to);
    }
  return std::move(out);
}

void
bindPlace(GridClass& type)
{
  type.def_property_readonly(
          "shape",
          [](const RiskGrid& g) { return py::make_tuple(g.rows, g.columns); },
          "(rows, columns): rows run against x, columns against y, so that cell (0, 0) "
          "is\nthat of largest x and y.")
      .def_property_readonly(
          "resolution_m",
          [](const RiskGrid& g) { return g.info.resolution_m; },
          "Side of a cell, m.")
      .def_property_readonly(
          "position",
          [](const RiskGrid& g) { return toArray(g.info.position); },
          "(3,) of the grid's middle, in its axes and from the map's origin, m; z is "
          "0.")
      .def_property_readonly(
          "axes",
          [](const RiskGrid& g) { return toArray(g.info.axes); },
          "(3, 3): axes of the grid as columns, frame of the map; z against the load.")
      .def_property_readonly(
          "x",
          [](const RiskGrid& g) { return middles(g, true); },
          "(rows,) x of the middles of cells, axes of the grid, m; it falls.")
      .def_property_readonly(
          "y",
          [](const RiskGrid& g) { return middles(g, false); },
          "(columns,) y of the middles of cells, axes of the grid, m; it falls.")
      .def_property_readonly("points",
                             pointsOf,
                             "(rows, columns, 3) middles of cells on the surface, "
                             "frame of the map, m; NaN\n"
                             "where none was seen. A copy, made when asked for.");
}

void
bindGrid(py::module_& module)
{
  GridClass type(
      module,
      "RiskGrid",
      "What risk_grid() says of every cell, in layers as grid_map has them: numpy "
      "views of\nthe grid's memory, read-only. grid['risk_total'] is one of them; "
      "iterating "
      "gives their\nnames.");
  type.def_property_readonly(
          "layers",
          layersOf,
          "dict of str: (rows, columns) float32, by name, in this order. In the axes "
          "of\n"
          "the grid: 'elevation', 'elevation_sigma' (m, along z), 'normal_x', "
          "'normal_y',\n'normal_z' (unit), 'slope_sigma' (the largest in any "
          "direction), 'curvature_min',\n'curvature_max' (1/m); at the best yaw: "
          "'risk_slip', 'risk_gap', 'risk_support',\n'risk_total', 'contact_area' "
          "(m^2), 'yaw_best' (of the sole's x axis about z, rad).\nNaN: no surface was "
          "seen there; of the risks but 'risk_support', of 'yaw_best' and\n"
          "'contact_area' also: too little of it under the sole.")
      .def_property_readonly(
          "assumptions",
          [](const RiskGrid&) { return riskAssumptions(); },
          "RISK_ASSUMPTIONS.")
      .def("__getitem__", layerOf, py::arg("name"))
      .def("__len__", [](const RiskGrid& g) { return g.layers.size(); })
      .def("__iter__", [](const py::object& self) { return py::iter(layersOf(self)); })
      .def("__repr__", [](const RiskGrid& g) {
        return "<holdfast.RiskGrid: " + std::to_string(g.rows) + " x " +
               std::to_string(g.columns) + " cells of " +
               py::str("{:g} m>").format(g.info.resolution_m).cast<std::string>();
      });
  bindPlace(type);
}

std::string
gridHelp()
{
  return documented(
      "risk_grid(patch_map, foot, load_direction, *, " + gridKeywords().signature() +
          ")",
      "The risk of putting the foot in the middle of every cell of a grid, for "
      "planners:\nlayers as grid_map_msgs/GridMap has them.\n"
      "\n"
      "    >>> grid = holdfast.risk_grid(patch_map, foot, (0, 1, 0))\n"
      "    >>> grid.layers['risk_total']               # (rows, columns) float32\n"
      "    >>> grid.x, grid.y, grid.points             # where its cells are\n"
      "\n"
      "Where patches lie above each other, that which the load meets first counts; "
      "where\nthey overlap, that whose anchor is nearest.\n"
      "\n"
      "Arguments\n"
      "    patch_map: a PatchMap.\n"
      "    foot: a Foot.\n"
      "    load_direction: (3,) of the force on the surface, frame of the map, of "
      "any\n"
      "        length: down. The map's frame is the camera's at first, with y down "
      "where\n"
      "        it looks straight ahead.\n" +
          gridKeywords().help() +
          "\n"
          "Returns\n"
          "    a RiskGrid. It does not depend on the number of threads.\n" +
          riskAssumptionsHelp() +
          "\n"
          "Raises\n"
          "    TypeError: an argument is of another kind, or there is no such option.\n"
          "    ValueError: a number makes no sense, a direction is zero, the grid "
          "would "
          "have\n        more than " +
          std::to_string(kMaxRiskGridCells / 1'000'000) +
          " million cells.\n"
          "\n"
          "The interpreter's lock is released while it computes.");
}

} // namespace

void
bindRiskGrid(py::module_& module)
{
  bindGrid(module);
  module.def("risk_grid",
             gridOf,
             py::arg("patch_map"),
             py::arg("foot"),
             py::arg("load_direction"),
             gridHelp().c_str());
}

} // namespace holdfast::python
