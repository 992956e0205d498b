#include "input_json.h"
#include "json_parts.h"
#include "json_split.h"
#include "patch_json.h"

#include "parallel/parallel_for.h"

#include <holdfast/fit/names.h>
#include <holdfast/io/patch_io.h>
#include <holdfast/validation/names.h>

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

namespace holdfast {
namespace {

using Json = nlohmann::ordered_json;

template <typename Enum>
Enum
known(const std::optional<Enum>& value, const std::string& name)
{
  if (!value)
    throw std::runtime_error("unknown status " + Json(name).dump());
  return *value;
}

/// A member that is an int. Json itself would make one of any number, 1e300 and 5e9.
int
wholeNumber(const Json& json, const std::string& name)
{
  const Json& value = json.at(name);
  constexpr double kLargest = std::numeric_limits<int>::max();
  if (!value.is_number_integer() || std::abs(value.get<double>()) > kLargest)
    throw std::runtime_error(Json(name).dump() + " is not a whole number");
  return value.get<int>();
}

void
readRejected(const Json& json, ExtractionResult& result)
{
  for (const auto& [name, ignored] : json.items()) {
    const int count = wholeNumber(json, name);
    if (const auto status = kStatusNames.find(name))
      result.rejected[*status] = count;
    else
      result.turned_down[known(kVerdictNames.find(name), name)] = count;
  }
}

double
number(const Json& json)
{
  return json.is_null() ? std::numeric_limits<double>::quiet_NaN() : json.get<double>();
}

PatchType
typeFromJson(const Json& json)
{
  const auto surface = surfaceFromName(json.at("surface").get<std::string>());
  const auto boundary = boundaryFromName(json.at("boundary").get<std::string>());
  if (!surface || !boundary || !isLegal({*surface, *boundary}))
    throw std::runtime_error("unknown patch type");
  return {*surface, *boundary};
}

void
readNumbers(const Json& json, FitResult& fit)
{
  const PatchType type = typeFromJson(json);
  const auto n = static_cast<std::size_t>(degreesOfFreedom(type));
  const Json& parameters = json.at("parameters");
  const Json& covariance = json.at("covariance");
  if (parameters.size() != n || covariance.size() != n)
    throw std::runtime_error("a patch does not have its degrees of freedom");
  ParameterVector vector(static_cast<Eigen::Index>(n));
  fit.covariance.resize(vector.size(), vector.size());
  for (std::size_t i = 0; i < n; ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    vector(row) = number(parameters[i]);
    if (covariance[i].size() != n)
      throw std::runtime_error("a covariance is not square");
    for (std::size_t j = 0; j < n; ++j)
      fit.covariance(row, static_cast<Eigen::Index>(j)) = number(covariance[i][j]);
  }
  fit.patch = unpack(type, vector);
}

/// Files of former versions hold accepted patches alone, and not all that is measured.
std::optional<Validation>
readMeasured(const Json& json, const FitResult& fit)
{
  const Json& residual = json.at("residual");
  if (residual.is_null())
    return std::nullopt;
  Validation validation;
  const std::string verdict = json.value("verdict", "accepted");
  validation.verdict = known(kVerdictNames.find(verdict), verdict);
  validation.residual.rms_m = number(residual.at("rms"));
  validation.residual.largest_m = number(residual.at("largest"));
  validation.residual.unexplained_m =
      number(residual.value("unexplained", Json(validation.residual.largest_m)));
  validation.coverage.share = number(json.at("coverage"));
  validation.chi2_per_dof = chi2PerDof(fit);
  const Json measured = json.value("measured", Json());
  if (measured.is_null())
    return validation;
  validation.extent_m = number(measured.at("extent"));
  validation.sagitta_m = number(measured.at("sagitta"));
  validation.curvature_per_m = number(measured.at("curvature"));
  validation.noise_m = number(measured.at("noise"));
  const auto optional = [](const Json& value) {
    return value.is_null() ? std::nullopt : std::optional(value.get<double>());
  };
  validation.view_angle_rad = optional(measured.at("view_angle"));
  validation.stray_share = optional(measured.at("stray"));
  return validation;
}

/// Files of former versions have neither state nor flags: there the state is that of
/// the parameters, and no covariance of it is known.
void
readState(const Json& json, double containment, FitResult& fit)
{
  fit.state = toState(fit.patch, containment);
  if (json.contains("flags"))
    for (const Json& flag : json.at("flags"))
      for (const FitFlagName& known : kFitFlagNames)
        fit.flags.*known.flag = fit.flags.*known.flag || flag == known.name;
  fit.nonlinearity = number(json.value("nonlinearity", Json(0.0)));
  const Json rows = json.value("state_covariance", Json::array());
  if (rows.empty())
    return;
  const auto n = static_cast<std::size_t>(stateLayoutOf(fit.patch.type).size());
  const Json& values = json.at("state");
  if (rows.size() != n || values.size() != n)
    throw std::runtime_error("a state has the wrong size");
  fit.state_covariance.resize(static_cast<Eigen::Index>(n),
                              static_cast<Eigen::Index>(n));
  StateVector x(static_cast<Eigen::Index>(n));
  for (std::size_t i = 0; i < n; ++i) {
    x[static_cast<Eigen::Index>(i)] = number(values.at(i));
    if (rows.at(i).size() != n)
      throw std::runtime_error("a covariance is not square");
    for (std::size_t j = 0; j < n; ++j)
      fit.state_covariance(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) =
          number(rows[i][j]);
  }
  Eigen::Vector3d normal;
  for (std::size_t i = 0; i < 3; ++i)
    normal[static_cast<Eigen::Index>(i)] = json.at("state_frame").at(i).at(2);
  fit.state = unpackState(fit.patch.type, x, normal);
}

ExtractedPatch
patchFromJson(const Json& json, double containment)
{
  ExtractedPatch extracted;
  FitResult& fit = extracted.fit;
  readNumbers(json, fit);
  const std::string status = json.at("status");
  fit.status = known(kStatusNames.find(status), status);
  fit.points = wholeNumber(json, "points");
  if (json.contains("uninformative_points")) // not in old files
    fit.uninformative_points = wholeNumber(json, "uninformative_points");
  fit.chi2 = number(json.at("chi2"));
  fit.chi2_dof = wholeNumber(json, "chi2_dof");
  // Not in files of former versions, which knew independent errors only.
  fit.chi2_expected = json.value("chi2_expected", static_cast<double>(fit.chi2_dof));
  fit.iterations = wholeNumber(json, "iterations");
  readState(json, containment, fit);
  if (const Json& seed = json.at("seed"); !seed.is_null()) {
    extracted.seed_index = wholeNumber(seed, "index");
    for (Eigen::Index i = 0; i < 3; ++i)
      extracted.seed(i) = number(seed.at("point").at(static_cast<std::size_t>(i)));
  }
  extracted.is_second_attempt = json.value("second_attempt", false);
  if (const Json& radius = json.at("radius"); !radius.is_null())
    extracted.radius_m = radius;
  extracted.validation = readMeasured(json, fit);
  return extracted;
}

/// In the frame of the points, which lies at the offset.
ExtractedPatch
readPatch(const Json& json, double containment, const Eigen::Vector3d& offset)
{
  ExtractedPatch read = patchFromJson(json, containment);
  read.fit.patch.c -= offset;
  read.fit.state.centre -= offset;
  if (read.seed_index)
    read.seed -= offset;
  return read;
}

/// Each from its own text: the tree of all of them would take gigabytes.
std::vector<ExtractedPatch>
readPatches(const std::vector<std::string_view>& texts,
            double containment,
            const Eigen::Vector3d& offset)
{
  constexpr std::size_t kPatches = 64; // of one piece of work
  std::vector<ExtractedPatch> patches(texts.size());
  const auto work = [&](int item, int) {
    const std::size_t begin = static_cast<std::size_t>(item) * kPatches;
    for (std::size_t i = begin; i < std::min(begin + kPatches, texts.size()); ++i)
      patches[i] = readPatch(Json::parse(texts[i]), containment, offset);
  };
  const std::size_t items = (texts.size() + kPatches - 1) / kPatches;
  parallelFor(static_cast<int>(items), items < 2 ? 1 : 0, work);
  return patches;
}

void
requireKnownSchema(const Json& json)
{
  if (!json.contains("schema"))
    return;
  const int schema = wholeNumber(json, "schema");
  if (schema < 1 || schema > io::kPatchJsonSchema)
    throw std::runtime_error(fmt::format("written by another version of holdfast: "
                                         "schema {}, this one reads up to {}",
                                         schema,
                                         io::kPatchJsonSchema));
}

} // namespace

PatchReport
readJson(const std::string& text)
{
  try {
    const auto split = io::splitJsonArray(text, "patches");
    const Json json = Json::parse(split ? split->rest : text);
    requireKnownSchema(json);
    PatchReport report;
    report.cloud = json.at("cloud");
    report.fingerprint = json.value("fingerprint", "");
    report.is_of_map = json.value("is_map", false);
    const double containment =
        json.at("options").value("containment", FitOptions{}.containment);
    if (!(containment > 0.0 && containment < 1.0))
      throw std::runtime_error("no result of holdfast: containment must lie between 0 "
                               "and 1");
    // Files of earlier versions have none.
    if (const auto offset = json.find("offset"); offset != json.end())
      report.offset = io::vectorFromJson<3>(*offset);
    if (split)
      report.result.patches = readPatches(split->elements, containment, report.offset);
    else
      for (const Json& patch : json.at("patches"))
        report.result.patches.push_back(readPatch(patch, containment, report.offset));
    if (const auto input = json.find("input"); input != json.end())
      report.file = io::inputFromJson(*input);
    if (const auto sensor = json.find("sensor"); sensor != json.end())
      report.sensor_pose = io::poseFromJson(*sensor, report.offset);
    readRejected(json.at("rejected"), report.result);
    return report;
  }
  catch (const Json::exception& error) {
    throw std::runtime_error(std::string("no result of holdfast: ") + error.what());
  }
}

} // namespace holdfast
