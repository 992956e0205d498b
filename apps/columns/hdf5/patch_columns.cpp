#include "patch_columns.h"

#include <holdfast/fit/names.h>
#include <holdfast/patch/names.h>
#include <holdfast/validation/names.h>

#include <nlohmann/json.hpp>

#include <cstddef>

namespace holdfast::app {
namespace {

/// Numbers with names, as h5py and others show them.
template <typename Words>
Handle
enumType(const Words& words, bool or_not_measured = false)
{
  Handle type(H5Tenum_create(H5T_NATIVE_UINT8), H5Tclose);
  std::uint8_t value = 0;
  for (const std::string_view word : words) {
    checkedCall(H5Tenum_insert(type, std::string(word).c_str(), &value));
    ++value;
  }
  if (or_not_measured) {
    value = PatchRow::kNotMeasured;
    checkedCall(H5Tenum_insert(type, "not_measured", &value));
  }
  return type;
}

Handle
native(hid_t type)
{
  return {H5Tcopy(type), H5Tclose};
}

void
addGeometry(std::vector<PatchColumn>& columns)
{
  const auto add =
      [&](const char* name, std::size_t offset, std::size_t count, const char* about) {
        columns.push_back({name, native(H5T_NATIVE_DOUBLE), offset, count, about});
      };
  add("centre", offsetof(PatchRow, centre), 3, "m, frame of the cloud's file");
  add("normal", offsetof(PatchRow, normal), 3, "z of the frame of the state");
  add("x_axis", offsetof(PatchRow, x_axis), 3, "x of that frame; y is z cross x");
  add("state",
      offsetof(PatchRow, state),
      kMaxState,
      "regular coordinates; their names by type: attribute 'names' of /patches");
  add("state_covariance",
      offsetof(PatchRow, state_covariance),
      kTriangle,
      "lower triangle row by row: entry (i, j <= i) is number i (i + 1) / 2 + j");
  add("parameters",
      offsetof(PatchRow, parameters),
      kMaxParameters,
      "d, k, r, c of the paper; their names by type: attribute 'names' of /patches");
  add("seed", offsetof(PatchRow, seed), 3, "m, frame of the cloud's file");
  add("chi2", offsetof(PatchRow, chi2), 1, "squared residuals over covariances");
  add("chi2_expected", offsetof(PatchRow, chi2_expected), 1, "mean if all is right");
}

void
addMeasures(std::vector<PatchColumn>& columns)
{
  const auto add = [&](const char* name, std::size_t offset, const char* about) {
    columns.push_back({name, native(H5T_NATIVE_FLOAT), offset, 1, about});
  };
  add("nonlinearity", offsetof(PatchRow, nonlinearity), "share of second order");
  add("radius", offsetof(PatchRow, radius), "of the neighbourhood, m");
  add("residual_rms", offsetof(PatchRow, residual_rms), "m");
  add("residual_largest", offsetof(PatchRow, residual_largest), "m");
  add("residual_unexplained",
      offsetof(PatchRow, residual_unexplained),
      "the largest that noise does not explain, m");
  add("coverage", offsetof(PatchRow, coverage), "share that points support");
  add("extent", offsetof(PatchRow, extent), "m");
  add("sagitta", offsetof(PatchRow, sagitta), "m");
  add("curvature", offsetof(PatchRow, curvature), "1/m");
  add("noise", offsetof(PatchRow, noise), "rms of a single point, m");
  add("view_angle", offsetof(PatchRow, view_angle), "rad");
  add("stray", offsetof(PatchRow, stray), "share of pixels with other points");
}

void
addCounts(std::vector<PatchColumn>& columns)
{
  const auto add = [&](const char* name, std::size_t offset, const char* about) {
    columns.push_back({name, native(H5T_NATIVE_INT32), offset, 1, about});
  };
  add("seed_index", offsetof(PatchRow, seed_index), "in the cloud; -1: none");
  add("points", offsetof(PatchRow, points), "used");
  add("uninformative_points", offsetof(PatchRow, uninformative_points), "left out");
  add("chi2_dof", offsetof(PatchRow, chi2_dof), "degrees of freedom");
  add("iterations", offsetof(PatchRow, iterations), "of the fit");
}

} // namespace

std::vector<PatchColumn>
patchColumns()
{
  std::vector<PatchColumn> columns;
  columns.push_back({"cloud",
                     native(H5T_NATIVE_UINT32),
                     offsetof(PatchRow, cloud),
                     1,
                     "row of /clouds"});
  const auto add_enum = [&](const char* name, Handle type, std::size_t offset) {
    columns.push_back({name, std::move(type), offset, 1, ""});
  };
  add_enum("surface", enumType(kSurfaceNames.words), offsetof(PatchRow, surface));
  add_enum("boundary", enumType(kBoundaryNames.words), offsetof(PatchRow, boundary));
  add_enum("status", enumType(kStatusNames.words), offsetof(PatchRow, status));
  add_enum("verdict", enumType(kVerdictNames.words, true), offsetof(PatchRow, verdict));
  columns.push_back({"flags",
                     native(H5T_NATIVE_UINT8),
                     offsetof(PatchRow, flags),
                     1,
                     "a bit each: attribute 'names' of /patches"});
  columns.push_back({"second_attempt",
                     native(H5T_NATIVE_UINT8),
                     offsetof(PatchRow, second_attempt),
                     1,
                     "1: fitted to the seed's surface alone"});
  addGeometry(columns);
  addMeasures(columns);
  addCounts(columns);
  return columns;
}

std::string
columnNames()
{
  using Json = nlohmann::ordered_json;
  Json types = Json::object();
  for (const PatchType type : kPatchTypes) {
    const std::string name = std::string(surfaceName(type.surface)) + "/" +
                             std::string(boundaryName(type.boundary));
    types[name] = {{"state", stateNames(type)}, {"parameters", parameterNames(type)}};
  }
  Json flags = Json::array();
  for (const FitFlagName& flag : kFitFlagNames)
    flags.push_back(flag.name);
  return Json{{"types", types}, {"flags", flags}}.dump();
}

} // namespace holdfast::app
