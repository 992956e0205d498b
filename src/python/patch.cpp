// One patch.
#include "bindings.h"

#include "arrays.h"
#include "keywords.h"
#include "patch_objects.h"
#include "patch_values.h"

#include <holdfast/fit/names.h>
#include <holdfast/patch/boundary.h>
#include <holdfast/validation/names.h>
#include <holdfast/validation/residual.h>

#include <pybind11/stl.h>

#include <algorithm>
#include <stdexcept>
#include <type_traits>
#include <utility>

namespace holdfast::python {

std::string
typeName(PatchType type)
{
  std::string name(surfaceName(type.surface));
  if (type.surface == SurfaceType::Plane)
    name += "_" + std::string(boundaryName(type.boundary));
  return name;
}

std::vector<std::string>
flagNames(const FitFlags& flags)
{
  std::vector<std::string> names;
  for (const FitFlagName& each : kFitFlagNames)
    if (flags.*(each.flag))
      names.emplace_back(each.name);
  return names;
}

Mesh
meshOf(const Patch& patch, const std::optional<double>& spacing)
{
  constexpr double kPieces = 8.0; // along the longest bound
  return tessellate(patch, spacing.value_or(patch.d.head<4>().maxCoeff() / kPieces));
}

void
append(const Mesh& mesh,
       std::vector<double>& vertices,
       std::vector<std::int32_t>& triangles)
{
  const auto first = static_cast<std::int32_t>(vertices.size() / 3);
  for (const Eigen::Vector3d& vertex : mesh.vertices)
    vertices.insert(vertices.end(), vertex.data(), vertex.data() + 3);
  for (const std::array<int, 3>& triangle : mesh.triangles)
    for (const int vertex : triangle)
      triangles.push_back(first + vertex);
}

StateVector
stateDifference(const FitResult& fit, const FitResult& reference)
{
  if (!isUsable(fit.status) || !isUsable(reference.status))
    return {};
  const auto isOpen = [](PatchType type) {
    return type.surface == SurfaceType::EllipticParaboloid ||
           type.surface == SurfaceType::HyperbolicParaboloid;
  };
  PatchState state = fit.state;
  if (isOpen(state.type) && isOpen(reference.state.type))
    state.type = reference.state.type;
  return state.type == reference.state.type ? difference(state, reference.state) :
                                              StateVector();
}

bool
isOfType(const ExtractedPatch& patch, const std::string& word)
{
  const auto surface = kSurfaceNames.find(word);
  const bool is_known =
      surface ||
      std::any_of(kPatchTypes.begin(), kPatchTypes.end(), [&](PatchType type) {
        return isSameName(typeName(type), word);
      });
  if (!is_known)
    throw std::invalid_argument("there is no type '" + word + "'");
  if (!isUsable(patch.fit.status))
    return false;
  const PatchType type = patch.fit.patch.type;
  return surface ? type.surface == *surface : isSameName(typeName(type), word);
}

namespace {

const FitResult&
fitOf(const PatchObject& self)
{
  return self.patch->fit;
}

template <typename Value>
py::object
toObject(Value value)
{
  if constexpr (std::is_base_of_v<py::object, Value>)
    return std::move(value);
  else
    return py::cast(value);
}

/// What there is where the fit came out, else None.
template <typename Value>
auto
whereUsable(Value value)
{
  return [value](const PatchObject& self) -> py::object {
    if (!isUsable(fitOf(self).status))
      return py::none();
    return toObject(value(fitOf(self)));
  };
}

template <typename Value>
auto
whereValidated(Value value)
{
  return [value](const PatchObject& self) -> py::object {
    const auto& validation = self.patch->validation;
    if (!validation || !isUsable(fitOf(self).status))
      return py::none();
    return py::cast(value(*validation));
  };
}

template <typename Container>
py::tuple
toTuple(const Container& values)
{
  py::tuple out(values.size());
  for (std::size_t i = 0; i < values.size(); ++i)
    out[i] = py::cast(values[i]);
  return out;
}

template <typename Matrix>
py::object
rareArray(const RareMatrix<Matrix>& rare)
{
  const Matrix& matrix = *rare;
  if (matrix.size() == 0)
    return py::none();
  return toArray(matrix);
}

const Patch&
requirePatch(const PatchObject& self)
{
  const FitResult& fit = fitOf(self);
  if (!isUsable(fit.status))
    throw std::invalid_argument("there is no patch: the fit ended with " +
                                std::string(statusName(fit.status)));
  return fit.patch;
}

py::tuple
meshArrays(const PatchObject& self, const py::object& spacing_m)
{
  std::optional<double> spacing;
  read("spacing", spacing_m, spacing);
  const Patch& patch = requirePatch(self);
  std::vector<double> vertices;
  std::vector<std::int32_t> triangles;
  {
    const py::gil_scoped_release release;
    append(meshOf(patch, spacing), vertices, triangles);
  }
  const auto vertex_count = static_cast<py::ssize_t>(vertices.size() / 3);
  const auto triangle_count = static_cast<py::ssize_t>(triangles.size() / 3);
  return py::make_tuple(keptArray(std::move(vertices), {vertex_count, 3}),
                        keptArray(std::move(triangles), {triangle_count, 3}));
}

py::array
differenceOf(const PatchObject& self, const PatchObject& other)
{
  const Patch& mine = requirePatch(self);
  const Patch& theirs = requirePatch(other);
  const StateVector between = stateDifference(fitOf(other), fitOf(self));
  if (between.size() == 0)
    throw py::value_error("other: it is of type " + typeName(theirs.type) +
                          ", this one of type " + typeName(mine.type));
  return toArray(between);
}

py::array_t<double>
distancesOf(const PatchObject& self, py::handle points)
{
  const Patch& patch = requirePatch(self);
  const Numbers rows = pointRows(points, "points");
  std::vector<double> distances;
  {
    const py::gil_scoped_release release;
    std::vector<Eigen::Vector3d> all;
    all.reserve(static_cast<std::size_t>(rows.shape(0)));
    for (py::ssize_t i = 0; i < rows.shape(0); ++i)
      all.emplace_back(Eigen::Map<const Eigen::Vector3d>(rows.data() + 3 * i));
    distances = distancesToSurface(patch, all);
  }
  const py::ssize_t count = rows.shape(0);
  return keptArray(std::move(distances), {count});
}

std::string
reprOf(const PatchObject& self)
{
  const FitResult& fit = fitOf(self);
  if (!isUsable(fit.status))
    return "<holdfast.Patch: " + std::string(statusName(fit.status)) + ">";
  const auto number = [](double x) {
    return py::str("{:.4g}").format(x).cast<std::string>();
  };
  const Eigen::Vector3d& c = fit.patch.c;
  return "<holdfast.Patch: " + typeName(fit.patch.type) + " at (" + number(c.x()) +
         ", " + number(c.y()) + ", " + number(c.z()) + ") m, chi2/dof " +
         number(chi2PerDof(fit)) + ", " + std::to_string(fit.points) + " points>";
}

/// All attributes, arrays as lists: what json and pandas take.
py::dict
dictOf(const py::object& self)
{
  py::dict out;
  const py::handle type = py::type::of(self);
  for (const auto& [name, member] : py::dict(type.attr("__dict__"))) {
    if (!py::isinstance(member, py::module_::import("builtins").attr("property")))
      continue;
    const py::object value = self.attr(name);
    out[name] = py::isinstance<py::array>(value) ? value.attr("tolist")() : value;
  }
  return out;
}

using PatchClass = py::class_<PatchObject>;

void
bindOutcome(PatchClass& type)
{
  type.def_property_readonly(
          "ok",
          [](const PatchObject& p) { return isUsable(fitOf(p).status); },
          "The fit came out: there is a patch with its covariance.")
      .def_property_readonly(
          "status",
          [](const PatchObject& p) { return std::string(statusName(fitOf(p).status)); },
          "How the fit ended: 'converged', 'too_few_points', 'degenerate', ...")
      .def_property_readonly(
          "flags",
          [](const PatchObject& p) {
            return toTuple(
                flagNames(isUsable(fitOf(p).status) ? fitOf(p).flags : FitFlags()));
          },
          "Names of what the data do not tell of the parameters: "
          "'axis_not_observable',\n"
          "'curvature_not_observable', 'orientation_singular'. State and covariance "
          "hold "
          "all\nthe same; entries concerned of `parameter_covariance` are NaN.")
      .def_property_readonly(
          "type",
          whereUsable([](const FitResult& f) { return typeName(f.patch.type); }),
          "'plane_ellipse', 'plane_circle', 'plane_rectangle', 'plane_quad', "
          "'sphere',\n"
          "'circular_cylinder', 'elliptic_paraboloid', 'hyperbolic_paraboloid',\n"
          "'cylindric_paraboloid' or 'circular_paraboloid'; None: no patch.")
      .def_property_readonly("surface",
                             whereUsable([](const FitResult& f) {
                               return std::string(surfaceName(f.patch.type.surface));
                             }),
                             "'plane', 'sphere', ...; None: no patch.")
      .def_property_readonly(
          "boundary",
          whereUsable([](const FitResult& f) {
            return std::string(boundaryName(f.patch.type.boundary));
          }),
          "'ellipse', 'circle', 'rectangle' or 'quad'; None: no patch.");
}

void
bindCoordinates(PatchClass& type)
{
  type.def_property_readonly(
          "state",
          whereUsable([](const FitResult& f) { return toArray(pack(f.state)); }),
          "(S,) regular coordinates [M | k | nu | c]: second moments of the support, "
          "m^2,\n"
          "curvature matrix in the tangent plane, 1/m, turn of the normal (zero: it "
          "is\n"
          "`normal`), and centre, m. S is 8 to 11 (fewer for planes and round types).")
      .def_property_readonly(
          "state_names",
          whereUsable(
              [](const FitResult& f) { return toTuple(stateNames(f.state.type)); }),
          "'M_xx', 'k_xy', 'nu_x', 'c_z', ... in the order of `state`.")
      .def_property_readonly(
          "covariance",
          whereUsable([](const FitResult& f) { return toArray(f.state_covariance); }),
          "(S, S) covariance of `state`; nu in rad. Right everywhere, also where the\n"
          "parameters have none.")
      .def_property_readonly(
          "white_covariance",
          [](const PatchObject& p) {
            return rareArray(fitOf(p).white_state_covariance);
          },
          "(S, S) the part of `covariance` that averages over frames of a camera that\n"
          "stands still; None unless separate_pattern=True was asked for.")
      .def_property_readonly(
          "parameters",
          whereUsable([](const FitResult& f) { return toArray(pack(f.patch)); }),
          "(P,) the paper's parameters [d | k | r | c]: bounds, m, curvatures, 1/m,\n"
          "exponential coordinates of the orientation, rad, and centre, m.")
      .def_property_readonly(
          "parameter_names",
          whereUsable(
              [](const FitResult& f) { return toTuple(parameterNames(f.patch.type)); }),
          "'d_x', 'kappa_y', 'r_x', 'c_z', ... in the order of `parameters`.")
      .def_property_readonly("parameter_covariance",
                             whereUsable([](const FitResult& f) {
                               return toArray(observableCovariance(f));
                             }),
                             "(P, P) covariance of `parameters`, first order; NaN "
                             "where `flags` say that the\n"
                             "data tell nothing.")
      .def_property_readonly(
          "mean_shift",
          [](const PatchObject& p) { return rareArray(fitOf(p).state_mean_shift); },
          "(S,) by how much the mean of `state` is off, to second order; None unless "
          "the\n"
          "covariance was computed to second order.");
}

void
bindGeometry(PatchClass& type)
{
  type.def_property_readonly(
          "centre",
          whereUsable([](const FitResult& f) { return toArray(f.patch.c); }),
          "(3,) origin of the patch, on the surface, m.")
      .def_property_readonly(
          "normal",
          whereUsable([](const FitResult& f) { return toArray(f.patch.normal()); }),
          "(3,) unit normal at the centre, towards the viewpoint.")
      .def_property_readonly(
          "pose",
          whereUsable([](const FitResult& f) { return toArray(f.patch.pose()); }),
          "(4, 4) from the patch's frame (z is the normal) to that of the points.")
      .def_property_readonly("curvatures",
                             whereUsable([](const FitResult& f) {
                               return toArray(f.patch.principalCurvatures());
                             }),
                             "(2,) along the patch's x and y axis, 1/m; positive: "
                             "bends towards the viewer.")
      .def_property_readonly(
          "bounds",
          whereUsable([](const FitResult& f) {
            return toArray(
                f.patch.d.head(boundaryParameterCount(f.patch.type.boundary)));
          }),
          "Of the boundary, m: ellipse and rectangle (2,) half-lengths, circle (1,)\n"
          "radius, quad (5,) corner distances and half-angle, rad.")
      .def_property_readonly(
          "area",
          whereUsable([](const FitResult& f) { return projectedArea(f.patch); }),
          "Within the boundary, in the tangent plane, m^2.")
      .def_property_readonly(
          "normal_sigma",
          whereUsable([](const FitResult& f) { return normalSigma(f); }),
          "Rms angle by which the normal may be off, rad.")
      .def_property_readonly(
          "centre_sigma",
          whereUsable([](const FitResult& f) { return centreSigma(f); }),
          "Rms distance by which the centre may be off, m.");
}

void
bindStatistics(PatchClass& type)
{
  type.def_property_readonly("chi2",
                             whereUsable([](const FitResult& f) { return f.chi2; }),
                             "Sum of squared residuals over the points' covariances.")
      .def_property_readonly("dof",
                             whereUsable([](const FitResult& f) { return f.chi2_dof; }),
                             "Points less surface parameters.")
      .def_property_readonly(
          "chi2_expected",
          whereUsable([](const FitResult& f) { return f.chi2_expected; }),
          "What `chi2` is on average where surface and noise are right: `dof`, but "
          "where\n"
          "points share errors.")
      .def_property_readonly(
          "chi2_per_dof",
          whereUsable([](const FitResult& f) { return chi2PerDof(f); }),
          "`chi2` / `chi2_expected`: about 1 where all is right.")
      .def_property_readonly(
          "nonlinearity",
          whereUsable([](const FitResult& f) { return f.nonlinearity; }),
          "Share of second order in the parameters' covariance.")
      .def_property_readonly(
          "points",
          [](const PatchObject& p) { return fitOf(p).points; },
          "Points used.")
      .def_property_readonly(
          "uninformative_points",
          [](const PatchObject& p) { return fitOf(p).uninformative_points; },
          "Points left out: their covariance is 100 times the others'.")
      .def_property_readonly(
          "invalid_points",
          [](const PatchObject& p) { return fitOf(p).invalid_points; },
          "Points left out: their covariance is none.")
      .def_property_readonly(
          "iterations",
          [](const PatchObject& p) { return fitOf(p).iterations; },
          "Gauss-Newton steps tried.");
}

void
bindOrigin(PatchClass& type)
{
  type.def_property_readonly(
          "accepted",
          [](const PatchObject& p) { return isAccepted(*p.patch); },
          "The fit came out, and no check turned it down.")
      .def_property_readonly(
          "verdict",
          [](const PatchObject& p) -> py::object {
            const auto& validation = p.patch->validation;
            return validation ?
                       py::cast(std::string(verdictName(validation->verdict))) :
                       py::object(py::none());
          },
          "Of the checks of extract(): 'accepted', 'residual_too_large', ...; None: "
          "none "
          "was\nmade.")
      .def_property_readonly(
          "residual",
          whereValidated([](const Validation& v) { return v.residual.rms_m; }),
          "Rms distance of the points from the surface, m; None: not measured.")
      .def_property_readonly(
          "coverage",
          whereValidated([](const Validation& v) { return v.coverage.share; }),
          "Share of the patch that its points cover; None: not measured.")
      .def_property_readonly(
          "seed",
          [](const PatchObject& p) -> py::object {
            if (!p.patch->seed_index)
              return py::none();
            return toArray(p.patch->seed);
          },
          "(3,) point that the neighbourhood is around, m; None: there was none.")
      .def_property_readonly(
          "seed_index",
          [](const PatchObject& p) { return p.patch->seed_index; },
          "Its row among the points: of an image v * W + u; None: there was none.")
      .def_property_readonly(
          "radius",
          [](const PatchObject& p) { return p.patch->radius_m; },
          "Of the neighbourhood, m; 0: there was none.");
}

} // namespace

void
bindPatch(py::module_& module)
{
  PatchClass type(
      module,
      "Patch",
      "A bounded curved patch with the covariance of its state, or how the\n"
      "attempt at one ended: then `ok` is False, `status` says why, and what\n"
      "there is not is None. Positions are in the frame of the points, m.");
  bindOutcome(type);
  bindCoordinates(type);
  bindGeometry(type);
  bindStatistics(type);
  bindOrigin(type);
  type.def("__repr__", reprOf)
      .def("to_dict",
           dictOf,
           "to_dict() -> dict\n\nAll attributes by name, arrays as lists.")
      .def("mesh",
           meshArrays,
           py::arg("spacing") = py::none(),
           "mesh(spacing=None) -> (vertices (V, 3) float64, triangles (T, 3) int32)\n\n"
           "The patch as triangles, counter-clockwise around the normal; for Open3D,\n"
           "trimesh, matplotlib's plot_trisurf. `spacing` between vertices, m; None: "
           "an\n"
           "eighth of the longest bound. ValueError where there is no patch.")
      .def("difference",
           differenceOf,
           py::arg("other"),
           "difference(other) -> (S,) float64\n\n"
           "State of another patch of the same type less that of this one, in this "
           "one's\n"
           "axes, with nu the turn from normal to normal, rad: what `covariance` is "
           "of.\n"
           "States themselves are each in axes of their own and cannot be subtracted.\n"
           "ValueError where one of both is no patch, or their types differ.")
      .def(
          "distance",
          distancesOf,
          py::arg("points"),
          "distance(points) -> (N,) float64\n\n"
          "Signed Euclidean distances of points (N, 3) from the unbounded surface, m;\n"
          "positive on the side of the normal. ValueError where there is no patch.");
}

} // namespace holdfast::python
