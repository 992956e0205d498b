// Many patches as arrays.
#include "bindings.h"

#include "arrays.h"
#include "keywords.h"
#include "patch_objects.h"
#include "patch_values.h"

#include <holdfast/fit/names.h>
#include <holdfast/io/patch_io.h>
#include <holdfast/validation/names.h>

#include <pybind11/stl.h>

#include <functional>
#include <limits>
#include <sstream>

namespace holdfast::python {

PatchesObject::PatchesObject(std::vector<ExtractedPatch> patches,
                             std::shared_ptr<const PatchSource> the_source)
: source(std::move(the_source))
{
  const auto all =
      std::make_shared<const std::vector<ExtractedPatch>>(std::move(patches));
  list.reserve(all->size());
  for (const ExtractedPatch& patch : *all)
    list.emplace_back(all, &patch);
}

namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// A number for each; NaN where there is no patch.
template <typename Value>
py::array
numberColumn(const PatchesObject& self, Value value)
{
  auto column = newArray<double>({static_cast<py::ssize_t>(self.list.size())});
  double* out = column.mutable_data();
  for (const auto& patch : self.list)
    *out++ = isUsable(patch->fit.status) ? static_cast<double>(value(*patch)) : kNaN;
  return column;
}

/// A whole number for each, whatever became of the patch.
template <typename Value>
py::array
countColumn(const PatchesObject& self, Value value)
{
  auto column = newArray<std::int64_t>({static_cast<py::ssize_t>(self.list.size())});
  std::int64_t* out = column.mutable_data();
  for (const auto& patch : self.list)
    *out++ = value(*patch);
  return column;
}

template <typename Value>
py::array
flagColumn(const PatchesObject& self, Value value)
{
  auto column = newArray<bool>({static_cast<py::ssize_t>(self.list.size())});
  bool* out = column.mutable_data();
  for (const auto& patch : self.list)
    *out++ = value(*patch);
  return column;
}

/// Texts of one width; empty where there is none.
template <typename Value>
py::array
textColumn(const PatchesObject& self, Value value)
{
  py::list texts;
  for (const auto& patch : self.list)
    texts.append(std::string(value(*patch)));
  return py::module_::import("numpy").attr("array")(texts, py::arg("dtype") = "U");
}

/// A vector for each; NaN behind the entries it has, and where there is no patch.
template <typename Value>
py::array
vectorColumn(const PatchesObject& self, py::ssize_t width, Value value)
{
  auto column = newArray<double>({static_cast<py::ssize_t>(self.list.size()), width});
  double* out = column.mutable_data();
  for (const auto& patch : self.list) {
    std::fill_n(out, width, kNaN);
    if (isUsable(patch->fit.status)) {
      const auto vector = value(*patch);
      std::copy_n(vector.data(), vector.size(), out);
    }
    out += width;
  }
  return column;
}

/// The same of square matrices.
template <typename Value>
py::array
matrixColumn(const PatchesObject& self, py::ssize_t width, Value value)
{
  auto column =
      newArray<double>({static_cast<py::ssize_t>(self.list.size()), width, width});
  double* out = column.mutable_data();
  for (const auto& patch : self.list) {
    std::fill_n(out, width * width, kNaN);
    if (isUsable(patch->fit.status)) {
      const auto matrix = value(*patch);
      for (Eigen::Index i = 0; i < matrix.rows(); ++i)
        for (Eigen::Index j = 0; j < matrix.cols(); ++j)
          out[i * width + j] = matrix(i, j);
    }
    out += width * width;
  }
  return column;
}

struct Column {
  const char* name;
  std::function<py::array(const PatchesObject&)> make;
  const char* help;
};

using E = ExtractedPatch;

template <typename Value>
Column
texts(const char* name, Value value, const char* help)
{
  return {name, [=](const PatchesObject& s) { return textColumn(s, value); }, help};
}

template <typename Value>
Column
numberOfEach(const char* name, Value value, const char* help)
{
  return {name, [=](const PatchesObject& s) { return numberColumn(s, value); }, help};
}

template <typename Value>
Column
countOfEach(const char* name, Value value, const char* help)
{
  return {name, [=](const PatchesObject& s) { return countColumn(s, value); }, help};
}

template <typename Value>
Column
flags(const char* name, Value value, const char* help)
{
  return {name, [=](const PatchesObject& s) { return flagColumn(s, value); }, help};
}

template <typename Value>
Column
vectors(const char* name, py::ssize_t width, Value value, const char* help)
{
  return {name,
          [=](const PatchesObject& s) { return vectorColumn(s, width, value); },
          help};
}

template <typename Value>
Column
matrices(const char* name, py::ssize_t width, Value value, const char* help)
{
  return {name,
          [=](const PatchesObject& s) { return matrixColumn(s, width, value); },
          help};
}

/// Empty where there is no patch.
std::string
wordOf(const E& p, std::string (*word)(PatchType))
{
  return isUsable(p.fit.status) ? word(p.fit.patch.type) : std::string();
}

std::string
surfaceWord(PatchType type)
{
  return std::string(surfaceName(type.surface));
}

std::string
boundaryWord(PatchType type)
{
  return std::string(boundaryName(type.boundary));
}

std::string
verdictWord(const E& p)
{
  return p.validation ? std::string(verdictName(p.validation->verdict)) : std::string();
}

const std::vector<Column>&
textColumns()
{
  static const std::vector<Column> columns{
      texts(
          "type",
          [](const E& p) { return wordOf(p, typeName); },
          "(N,) texts as Patch.type; '' where there is no patch."),
      texts(
          "surface",
          [](const E& p) { return wordOf(p, surfaceWord); },
          "(N,) texts as Patch.surface; '' where there is no patch."),
      texts(
          "boundary",
          [](const E& p) { return wordOf(p, boundaryWord); },
          "(N,) texts as Patch.boundary; '' where there is no patch."),
      texts(
          "status",
          [](const E& p) { return statusName(p.fit.status); },
          "(N,) texts as Patch.status."),
      texts("verdict",
            verdictWord,
            "(N,) texts as Patch.verdict; '' where no check was made."),
  };
  return columns;
}

const std::vector<Column>&
geometryColumns()
{
  static const std::vector<Column> columns{
      vectors(
          "centre",
          3,
          [](const E& p) { return p.fit.patch.c; },
          "(N, 3) origins of the patches, m."),
      vectors(
          "normal",
          3,
          [](const E& p) { return p.fit.patch.normal(); },
          "(N, 3) unit normals."),
      vectors(
          "curvatures",
          2,
          [](const E& p) { return p.fit.patch.principalCurvatures(); },
          "(N, 2) along the patches' x and y axes, 1/m."),
      numberOfEach(
          "normal_sigma",
          [](const E& p) { return normalSigma(p.fit); },
          "(N,) rms angles by which the normals may be off, rad."),
      numberOfEach(
          "centre_sigma",
          [](const E& p) { return centreSigma(p.fit); },
          "(N,) rms distances by which the centres may be off, m."),
  };
  return columns;
}

const std::vector<Column>&
coordinateColumns()
{
  static const std::vector<Column> columns{
      vectors(
          "state",
          kMaxState,
          [](const E& p) { return pack(p.fit.state); },
          "(N, 11) as Patch.state, NaN behind what a type has."),
      matrices(
          "covariance",
          kMaxState,
          [](const E& p) { return p.fit.state_covariance; },
          "(N, 11, 11) as Patch.covariance, NaN behind what a type has."),
      vectors(
          "parameters",
          kMaxParameters,
          [](const E& p) { return pack(p.fit.patch); },
          "(N, 11) as Patch.parameters, NaN behind what a type has."),
      matrices(
          "parameter_covariance",
          kMaxParameters,
          [](const E& p) { return observableCovariance(p.fit); },
          "(N, 11, 11) as Patch.parameter_covariance, NaN behind what a type has."),
      countOfEach(
          "state_size",
          [](const E& p) { return p.fit.state_covariance.rows(); },
          "(N,) how many entries of `state` there are; 0 where there is no patch."),
      countOfEach(
          "parameter_size",
          [](const E& p) { return p.fit.covariance.rows(); },
          "(N,) how many entries of `parameters` there are; 0 where there is no "
          "patch."),
  };
  return columns;
}

const std::vector<Column>&
statisticColumns()
{
  static const std::vector<Column> columns{
      numberOfEach(
          "chi2",
          [](const E& p) { return p.fit.chi2; },
          "(N,) as Patch.chi2."),
      numberOfEach(
          "chi2_expected",
          [](const E& p) { return p.fit.chi2_expected; },
          "(N,) as Patch.chi2_expected."),
      numberOfEach(
          "chi2_per_dof",
          [](const E& p) { return chi2PerDof(p.fit); },
          "(N,) as Patch.chi2_per_dof."),
      countOfEach(
          "dof",
          [](const E& p) { return p.fit.chi2_dof; },
          "(N,) points less surface parameters."),
      countOfEach(
          "points",
          [](const E& p) { return p.fit.points; },
          "(N,) points used."),
  };
  return columns;
}

const std::vector<Column>&
originColumns()
{
  static const std::vector<Column> columns{
      flags(
          "ok",
          [](const E& p) { return isUsable(p.fit.status); },
          "(N,) bool: the fit came out."),
      flags(
          "accepted",
          [](const E& p) { return isAccepted(p); },
          "(N,) bool: the fit came out, and no check turned it down."),
      countOfEach(
          "seed_index",
          [](const E& p) { return p.seed_index.value_or(-1); },
          "(N,) rows of the seeds among the points; -1: there was none."),
      numberOfEach(
          "radius",
          [](const E& p) { return p.radius_m; },
          "(N,) of the neighbourhoods, m."),
      numberOfEach(
          "residual",
          [](const E& p) { return p.validation ? p.validation->residual.rms_m : kNaN; },
          "(N,) rms distances of the points from the surfaces, m."),
      numberOfEach(
          "coverage",
          [](const E& p) { return p.validation ? p.validation->coverage.share : kNaN; },
          "(N,) shares of the patches that their points cover."),
  };
  return columns;
}

template <typename Visit>
void
visitColumns(Visit visit)
{
  for (const auto* table : {&textColumns(),
                            &geometryColumns(),
                            &coordinateColumns(),
                            &statisticColumns(),
                            &originColumns()})
    for (const Column& column : *table)
      visit(column);
}

/// Made once; nobody may write to what all share.
py::object
columnOf(PatchesObject& self, const Column& column)
{
  const py::str name(column.name);
  if (!self.columns.contains(name)) {
    py::array made = column.make(self);
    made.attr("flags").attr("writeable") = false;
    self.columns[name] = made;
  }
  return self.columns[name];
}

PatchObject
patchAt(const PatchesObject& self, py::ssize_t index)
{
  const auto count = static_cast<py::ssize_t>(self.list.size());
  const py::ssize_t at = index < 0 ? index + count : index;
  if (at < 0 || at >= count)
    throw py::index_error("there are " + std::to_string(count) +
                          " patches, none has "
                          "number " +
                          std::to_string(index));
  return {self.list[static_cast<std::size_t>(at)]};
}

/// Those that numpy would take from an array; slices of arrays are views of them.
PatchesObject
chosenFrom(const PatchesObject& self, py::handle choice)
{
  const py::module_ numpy = py::module_::import("numpy");
  const py::object chosen = numpy.attr("arange")(self.list.size())[choice];
  const auto rows = py::array_t<std::int64_t, py::array::forcecast>(chosen);
  if (rows.ndim() != 1)
    throw py::index_error("patches stand in a row: choose by a number, a slice, a mask "
                          "(N,) or numbers (K,)");
  PatchesObject::List list;
  for (py::ssize_t i = 0; i < rows.shape(0); ++i)
    list.push_back(self.list[static_cast<std::size_t>(rows.at(i))]);
  PatchesObject out(std::move(list), self.source);
  for (const auto& [name, column] : self.columns) {
    py::object part = column[choice];
    part.attr("flags").attr("writeable") = false;
    out.columns[name] = part;
  }
  return out;
}

py::object
itemOf(const py::object& self, py::handle choice)
{
  const auto& patches = self.cast<const PatchesObject&>();
  // A bool would be taken for a number.
  if (PyIndex_Check(choice.ptr()) != 0 && PyBool_Check(choice.ptr()) == 0 &&
      !py::isinstance<py::array>(choice))
    return py::cast(
        patchAt(patches, py::int_(py::reinterpret_borrow<py::object>(choice))));
  return py::cast(chosenFrom(patches, choice));
}

py::array
differencesOf(const PatchesObject& self, const PatchObject& other)
{
  const FitResult& to = other.patch->fit;
  if (!isUsable(to.status))
    throw py::value_error("other: it is no patch: " +
                          std::string(statusName(to.status)));
  return vectorColumn(self, kMaxState, [&](const ExtractedPatch& p) {
    return stateDifference(to, p.fit);
  });
}

std::string
jsonOf(const PatchesObject& self)
{
  const py::gil_scoped_release release;
  PatchReport report;
  report.cloud = "array";
  report.whole = !self.source;
  report.covariances_of_cloud = true;
  if (self.source) {
    report.sensor_pose = self.source->sensor_pose;
    report.options = self.source->options;
    report.options.progress = {};
    report.covariances_of_cloud = self.source->covariances_of_cloud;
    report.result = self.source->result;
  }
  for (const auto& patch : self.list)
    report.result.patches.push_back(*patch);
  std::ostringstream out;
  writeJson(out, report, JsonLayout::OneLine);
  return out.str();
}

template <typename Enum, typename Name>
py::dict
countsOf(const std::map<Enum, int>& counts, Name name)
{
  py::dict out;
  for (const auto& [key, count] : counts)
    out[py::str(std::string(name(key)))] = count;
  return out;
}

py::dict
pointsOf(const PatchesObject& self)
{
  py::dict out;
  if (!self.source)
    return out;
  const PointAccounting& points = self.source->result.points;
  out["in_cloud"] = points.in_cloud;
  out["invalid"] = points.invalid;
  out["behind_camera"] = points.behind_camera;
  out["out_of_view"] = points.out_of_view;
  out["invalid_covariance"] = points.invalid_covariance;
  out["duplicate"] = points.duplicate;
  out["used"] = points.used;
  return out;
}

using PatchesClass = py::class_<PatchesObject>;

void
bindSource(PatchesClass& type)
{
  type.def_property_readonly(
          "rejected",
          [](const PatchesObject& s) {
            return s.source ? countsOf(s.source->result.rejected, statusName) :
                              py::dict();
          },
          "How many seeds of extract() gave no patch, by status.")
      .def_property_readonly(
          "turned_down",
          [](const PatchesObject& s) {
            return s.source ? countsOf(s.source->result.turned_down, verdictName) :
                              py::dict();
          },
          "How many patches the checks of extract() turned down, by verdict.")
      .def_property_readonly(
          "accounting",
          pointsOf,
          "What became of the points given to extract(), in numbers.")
      .def_property_readonly(
          "notices",
          [](const PatchesObject& s) {
            return s.source ? s.source->result.notices : std::vector<std::string>();
          },
          "What extract() has to say, a text each: what was assumed or left out.");
}

py::tuple
meshesOf(const PatchesObject& self, const py::object& spacing_m)
{
  std::optional<double> spacing;
  read("spacing", spacing_m, spacing);
  std::vector<double> vertices;
  std::vector<std::int32_t> triangles, owners;
  {
    const py::gil_scoped_release release;
    for (std::size_t i = 0; i < self.list.size(); ++i)
      if (isUsable(self.list[i]->fit.status)) {
        append(meshOf(self.list[i]->fit.patch, spacing), vertices, triangles);
        owners.resize(triangles.size() / 3, static_cast<std::int32_t>(i));
      }
  }
  const auto rows = [](std::size_t numbers) {
    return static_cast<py::ssize_t>(numbers / 3);
  };
  const py::ssize_t vertex_count = rows(vertices.size());
  const py::ssize_t triangle_count = rows(triangles.size());
  return py::make_tuple(keptArray(std::move(vertices), {vertex_count, 3}),
                        keptArray(std::move(triangles), {triangle_count, 3}),
                        keptArray(std::move(owners), {triangle_count}));
}

void
bindContainer(PatchesClass& type)
{
  type.def("__len__", [](const PatchesObject& self) { return self.list.size(); })
      .def("__getitem__", itemOf, py::arg("choice"))
      .def("__iter__",
           [](const py::object& self) {
             return py::reinterpret_steal<py::object>(PySeqIter_New(self.ptr()));
           })
      .def("__repr__", [](const PatchesObject& self) {
        return "<holdfast.Patches: " + std::to_string(self.list.size()) + ">";
      });
}

void
bindQuestions(PatchesClass& type)
{
  type.def(
          "mask",
          [](const PatchesObject& self, const py::object& type_name) {
            const std::string word = readText("type", type_name);
            // Says that it is no type when there are no patches, too.
            isOfType(ExtractedPatch(), word);
            return flagColumn(self, [&](const ExtractedPatch& p) {
              return isOfType(p, word);
            });
          },
          py::arg("type"),
          "mask(type) -> (N,) bool\n\n"
          "Which patches are of a surface ('plane', 'sphere', ...) or a type\n"
          "('plane_circle', ...). ValueError for what is neither.")
      .def("difference",
           differencesOf,
           py::arg("other"),
           "difference(other) -> (N, 11) float64\n\n"
           "As Patch.difference(), of one other patch to each: row i is in the axes "
           "that\n"
           "covariance[i] is in. NaN where there is no patch, or one of another type.")
      .def(
          "to_dict",
          [](PatchesObject& self) {
            py::dict out;
            visitColumns([&](const Column& c) { out[c.name] = columnOf(self, c); });
            return out;
          },
          "to_dict() -> dict of str: array\n\nAll arrays by name.")
      .def("mesh",
           meshesOf,
           py::arg("spacing") = py::none(),
           "mesh(spacing=None) -> (vertices (V, 3), triangles (T, 3), owners (T,))\n\n"
           "All patches as one mesh; owners[t] is the number of the patch that "
           "triangle t\n"
           "belongs to. `spacing` as for Patch.mesh().")
      .def("to_json",
           jsonOf,
           "to_json() -> str\n\n"
           "One JSON object in the format of the program's results (holdfast fit "
           "--json);\n"
           "numbers survive the way to text and back bit for bit.");
}

} // namespace

void
bindPatches(py::module_& module)
{
  bindPatch(module);
  PatchesClass type(
      module,
      "Patches",
      "Patches in a row, and what they have as read-only arrays of N rows, made once\n"
      "when first asked for and shared from then on.\n\n"
      "`patches[3]` is a Patch; a slice, a mask or numbers give Patches, whose arrays "
      "are\n"
      "views after a slice: patches[patches.surface == 'sphere'], "
      "patches[:10].centre.");
  visitColumns([&](const Column& column) {
    const Column* kept = &column;
    type.def_property_readonly(
        column.name,
        [kept](PatchesObject& self) { return columnOf(self, *kept); },
        column.help);
  });
  bindSource(type);
  bindContainer(type);
  bindQuestions(type);
}

} // namespace holdfast::python
