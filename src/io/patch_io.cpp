#include "input_json.h"
#include "json_split.h"
#include "json_text.h"
#include "pcd_writer.h"

#include "parallel/parallel_for.h"

#include <holdfast/fit/names.h>
#include <holdfast/io/patch_io.h>
#include <holdfast/patch/tessellation.h>
#include <holdfast/pcl/conversions.h>
#include <holdfast/pcl/names.h>
#include <holdfast/sensor/names.h>
#include <holdfast/validation/names.h>
#include <holdfast/version.h>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <pcl/conversions.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <stdexcept>

namespace holdfast {
namespace {

using Json = nlohmann::ordered_json;

/// Of the JSON, raised where a reader of the former one would go wrong: 2 since patches
/// have a state, and null in the covariance of parameters that are not observable.
/// Files of version 1 do not name it.
constexpr int kSchema = 2;

template <typename Derived>
Json
vectorJson(const Eigen::MatrixBase<Derived>& v)
{
  Json array = Json::array();
  for (Eigen::Index i = 0; i < v.size(); ++i)
    array.push_back(v(i));
  return array;
}

/// What the covariances of the points came from.
std::string
noiseName(const PatchReport& report)
{
  return report.covariances_of_cloud ? "covariances of the cloud" :
         report.result.sensor.noise  ? report.result.sensor.noise->name() :
                                       "none";
}

/// In the unit of the model: px of disparity for stereo, m at 1 m for others.
Json
patternJson(const NoisePattern& pattern)
{
  Json waves = Json::array();
  for (const PatternWave& wave : pattern.waves)
    waves.push_back({{"sigma", wave.sigma},
                     {"length_px", wave.length_px},
                     {"shape", kPatternShapeNames.of(wave.shape)}});
  return waves;
}

Json
sensorJson(const PatchReport& report)
{
  const Sensor& sensor = report.result.sensor;
  const Eigen::Quaterniond q(report.sensor_pose.R);
  const Eigen::Vector3d position = report.sensor_pose.c + report.offset;
  return {{"name", sensor.name},
          {"noise", noiseName(report)},
          {"pattern", patternJson(sensor.pattern)},
          {"camera", io::cameraJson(sensor.camera)},
          {"position", vectorJson(position)},
          {"orientation_wxyz", {q.w(), q.x(), q.y(), q.z()}},
          {"viewpoint_credible", report.result.viewpoint_is_credible}};
}

Json
pointsJson(const PointAccounting& points)
{
  return {{"in_file", points.in_cloud},
          {"invalid", points.invalid},
          {"behind_camera", points.behind_camera},
          {"out_of_view", points.out_of_view},
          {"invalid_covariance", points.invalid_covariance},
          {"duplicate", points.duplicate},
          {"used", points.used}};
}

/// Null where there is none.
template <typename T>
Json
limitJson(T limit)
{
  return limit > 0 ? Json(limit) : Json();
}

Json
samplerJson(const SamplerOptions& sampler)
{
  Json json = {{"neighborhood", kNeighborhoodNames.of(sampler.neighborhood)}};
  if (sampler.neighborhood == Neighborhood::Knn)
    json["k"] = sampler.k;
  else
    json["radius"] = sampler.radius_m;
  json["seed_strategy"] = kSeedStrategyNames.of(sampler.strategy);
  json["seeds"] = limitJson(sampler.max_seeds);
  json["spacing"] = sampler.spacing_m;
  json["max_patches"] = limitJson(sampler.max_patches);
  json["max_area"] = limitJson(sampler.max_area_m2);
  json["max_time"] = limitJson(sampler.max_time_s);
  json["random_seed"] = sampler.random_seed;
  return json;
}

/// Null where there is no value.
template <typename T>
Json
optionalJson(const std::optional<T>& value)
{
  return value ? Json(*value) : Json();
}

/// Null when patches were not even measured.
Json
validationJson(const std::optional<ValidationOptions>& validation)
{
  if (!validation)
    return {};
  return {{"max_extent", optionalJson(validation->max_extent)},
          {"max_sagitta", optionalJson(validation->max_sagitta)},
          {"max_bend", optionalJson(validation->max_bend)},
          {"max_departure", optionalJson(validation->max_departure)},
          {"max_noise", optionalJson(validation->max_noise)},
          {"max_stray", optionalJson(validation->max_stray)},
          {"max_view_angle", optionalJson(validation->max_view_angle_rad)},
          {"max_curvature", optionalJson(validation->max_curvature_per_m)},
          {"max_residual", optionalJson(validation->max_residual_m)},
          {"min_coverage", optionalJson(validation->min_coverage)},
          {"max_chi2_per_dof", optionalJson(validation->max_chi2_per_dof)}};
}

Json
optionsJson(const PatchReport& report)
{
  const FitOptions& fit = report.options.fit;
  return {{"whole", report.whole},
          {"sampler", report.whole ? Json() : samplerJson(report.options.sampler)},
          {"surface", kSurfaceRequestNames.of(fit.surface)},
          {"boundary",
           fit.plane_boundary ? Json(boundaryName(*fit.plane_boundary)) : Json()},
          {"containment", fit.containment},
          {"curvature_tolerance", fit.curvature_tolerance_per_m},
          {"flat_within", fit.flat_within_m},
          {"discrimination_level", fit.discrimination_level},
          {"residual", kResidualNames.of(fit.residual)},
          {"debias_scatter", fit.debias_scatter},
          {"noise_at_surface", fit.noise_at_surface},
          {"normal_from_pca", fit.normal_from_pca},
          {"smooth_circle_radius", fit.smooth_circle_radius},
          {"statistical_discrimination", fit.statistical_discrimination},
          {"covariance", covarianceModeName(report.options.covariance)},
          {"max_overlap", report.options.max_overlap},
          {"validation", validationJson(report.options.validation)}};
}

/// What is the same for all patches of a type, as text.
struct TypeText {
  std::string type; ///< members "surface" to "names"
  std::string state_names;
};

TypeText
makeTypeText(PatchType type)
{
  const Json members = {{"surface", surfaceName(type.surface)},
                        {"boundary", boundaryName(type.boundary)},
                        {"dof", degreesOfFreedom(type)},
                        {"names", parameterNames(type)}};
  const std::string object = members.dump();
  return {object.substr(1, object.size() - 2), Json(stateNames(type)).dump()};
}

const TypeText&
typeText(PatchType type)
{
  static const std::array<TypeText, kPatchTypes.size()> texts = [] {
    std::array<TypeText, kPatchTypes.size()> made;
    std::transform(kPatchTypes.begin(), kPatchTypes.end(), made.begin(), makeTypeText);
    return made;
  }();
  const auto* at = std::find(kPatchTypes.begin(), kPatchTypes.end(), type);
  return texts.at(static_cast<std::size_t>(at - kPatchTypes.begin()));
}

/// The names of those that are set.
void
addFlags(const FitFlags& flags, io::JsonObject& json)
{
  std::string& out = json.member("flags");
  char before = '[';
  for (const auto& [name, flag] : kFitFlagNames)
    if (flags.*flag) {
      out += before;
      io::appendJson(name, out);
      before = ',';
    }
  out += before == '[' ? "[]" : "]";
}

CovarianceMode
modeOf(const FitResult& fit, const ExtractionOptions& options)
{
  if (options.covariance != CovarianceMode::Auto)
    return options.covariance;
  return fit.mean_shift->size() > 0 ? CovarianceMode::SecondOrder :
                                      CovarianceMode::Exact;
}

void
addEstimate(const FitResult& fit, const PatchReport& report, io::JsonObject& json)
{
  const TypeText& text = typeText(fit.patch.type);
  Patch in_file = fit.patch;
  in_file.c += report.offset;
  PatchState state = fit.state;
  state.centre += report.offset;
  json.addText(text.type);
  json.add("parameters", pack(in_file));
  json.addMatrix("covariance", observableCovariance(fit));
  addFlags(fit.flags, json);
  json.add("nonlinearity", fit.nonlinearity);
  json.add("state", pack(state));
  json.member("state_names") += text.state_names;
  json.addMatrix("state_covariance", fit.state_covariance);
  json.addMatrix("state_frame", state.frame());
  json.add("covariance_mode", covarianceModeName(modeOf(fit, report.options)));
  json.add("status", statusName(fit.status));
  json.add("points", fit.points);
  json.add("uninformative_points", fit.uninformative_points);
  json.add("chi2", fit.chi2);
  json.add("chi2_dof", fit.chi2_dof);
  json.add("chi2_expected", fit.chi2_expected);
  json.add("iterations", fit.iterations);
}

void
addOptional(const char* name, std::optional<double> value, io::JsonObject& json)
{
  if (value)
    json.add(name, *value);
  else
    json.addNull(name);
}

/// The verdict and what it is about, but for chi-square, which is the fit's.
void
addValidation(const std::optional<Validation>& validation, io::JsonObject& json)
{
  if (!validation) {
    for (const char* name : {"verdict", "residual", "coverage", "measured"})
      json.addNull(name);
    return;
  }
  json.add("verdict", verdictName(validation->verdict));
  io::JsonObject residual(json.member("residual"));
  residual.add("rms", validation->residual.rms_m);
  residual.add("largest", validation->residual.largest_m);
  residual.add("unexplained", validation->residual.unexplained_m);
  residual.end();
  json.add("coverage", validation->coverage.share);
  io::JsonObject measured(json.member("measured"));
  measured.add("extent", validation->extent_m);
  measured.add("sagitta", validation->sagitta_m);
  measured.add("curvature", validation->curvature_per_m);
  measured.add("noise", validation->noise_m);
  addOptional("view_angle", validation->view_angle_rad, measured);
  addOptional("stray", validation->stray_share, measured);
  measured.end();
}

void
addOrigin(const ExtractedPatch& extracted,
          const Eigen::Vector3d& offset,
          io::JsonObject& json)
{
  json.add("second_attempt", extracted.is_second_attempt);
  if (extracted.seed_index) {
    io::JsonObject seed(json.member("seed"));
    seed.add("index", *extracted.seed_index);
    seed.add("point", extracted.seed + offset);
    seed.end();
  }
  else
    json.addNull("seed");
  if (extracted.radius_m > 0.0)
    json.add("radius", extracted.radius_m);
  else
    json.addNull("radius");
}

/// What only some patches have.
void
addParts(const FitResult& fit, io::JsonObject& json)
{
  if (fit.mean_shift->size() > 0) {
    json.add("mean_shift", *fit.mean_shift);
    json.add("state_mean_shift", *fit.state_mean_shift);
  }
  if (fit.white_state_covariance->size() > 0) {
    const StateMatrix pattern = fit.state_covariance - *fit.white_state_covariance;
    json.addMatrix("state_covariance_white", *fit.white_state_covariance);
    json.addMatrix("state_covariance_pattern", pattern);
  }
}

/// What only patches of a map have.
void
addMapPatch(const PatchMap& of, const MapPatch& patch, io::JsonObject& json)
{
  io::JsonObject map(json.member("map"));
  map.add("id", patch.id);
  map.add("views", patch.views);
  map.add("independent_views", patch.epochs);
  map.add("last_seen", patch.last_seen);
  map.add("conflicts", patch.conflicts);
  map.add("radius", patch.radius_m);
  map.add("roughness", of.roughnessOf(patch));
  map.add("anchor_position", patch.anchor.c);
  map.addMatrix("anchor_rotation", patch.anchor.R);
  map.add("jet", patch.jet.value());
  map.addMatrix("jet_covariance", patch.jet.covariance());
  Eigen::Matrix<double, SupportGrid::kCells, 1> rows;
  for (int i = 0; i < SupportGrid::kCells; ++i)
    rows[i] = patch.support.rows()[static_cast<std::size_t>(i)];
  map.add("support", rows);
  map.end();
}

void
appendPatch(const ExtractedPatch& extracted,
            const PatchReport& report,
            std::size_t index,
            std::string& out)
{
  io::JsonObject json(out);
  addEstimate(extracted.fit, report, json);
  addValidation(extracted.validation, json);
  addOrigin(extracted, report.offset, json);
  addParts(extracted.fit, json);
  if (report.map)
    addMapPatch(*report.map, report.map->patches()[index], json);
  json.end();
}

Json
timingJson(const PatchReport& report)
{
  const double seconds = 1e-3 * report.fit_ms;
  const auto patches = static_cast<double>(report.result.patches.size());
  return {{"load_ms", report.load_ms},
          {"fit_ms", report.fit_ms},
          {"patches_per_second", seconds > 0.0 ? Json(patches / seconds) : Json()}};
}

Json
rejectedJson(const ExtractionResult& result)
{
  Json json = Json::object();
  for (const auto& [status, count] : result.rejected)
    json[std::string(statusName(status))] = count;
  for (const auto& [verdict, count] : result.turned_down)
    json[std::string(verdictName(verdict))] = count;
  return json;
}

/// The patches [begin, end), of which all but the very first follow another.
std::string
patchesText(const PatchReport& report,
            std::size_t begin,
            std::size_t end,
            std::string_view between)
{
  std::string text;
  for (std::size_t i = begin; i < end; ++i) {
    if (i > 0)
      text += between;
    appendPatch(report.result.patches[i], report, i, text);
  }
  return text;
}

/// Round after round, so that the text of all patches never has to be in memory: some
/// threads print while one writes what the last round printed. The text does not depend
/// on their number.
void
writePatches(std::ostream& out, const PatchReport& report, std::string_view between)
{
  constexpr std::size_t kPatches = 64; // of one piece of work
  const std::size_t count = report.result.patches.size();
  const std::size_t blocks = (count + kPatches - 1) / kPatches;
  const auto at_once =
      static_cast<std::size_t>(8 * threadCount(report.options.threads));
  std::vector<std::string> printed, texts;
  for (std::size_t first = 0; first < blocks || !printed.empty(); first += at_once) {
    texts.assign(first < blocks ? std::min(at_once, blocks - first) : 0, {});
    const auto work = [&](int item, int) {
      if (item == 0) {
        for (const std::string& text : printed)
          out << text;
        return;
      }
      const std::size_t slot = static_cast<std::size_t>(item) - 1;
      const std::size_t begin = (first + slot) * kPatches;
      texts[slot] =
          patchesText(report, begin, std::min(begin + kPatches, count), between);
    };
    const auto items = static_cast<int>(texts.size()) + 1;
    // Threads take longer to start than few patches to print.
    parallelFor(items, count <= kPatches ? 1 : report.options.threads, work);
    printed.swap(texts);
  }
}

/// File names need not be UTF-8; JSON must.
std::string
text(const Json& json)
{
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

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
  if (schema < 1 || schema > kSchema)
    throw std::runtime_error(fmt::format("written by another version of holdfast: "
                                         "schema {}, this one reads up to {}",
                                         schema,
                                         kSchema));
}

/// All meshes as one.
struct ColoredMesh {
  std::vector<Eigen::Vector3d> vertices;
  std::vector<std::array<std::uint8_t, 3>> colors; ///< one per vertex
  std::vector<std::array<std::int32_t, 3>> triangles;
};

std::array<std::uint8_t, 3>
shadedColor(const ExtractedPatch& extracted)
{
  std::array<std::uint8_t, 3> color = surfaceColor(extracted.fit.patch.type.surface);
  if (extracted.validation)
    for (std::uint8_t& channel : color)
      channel = static_cast<std::uint8_t>(
          0.5 * (1.0 + extracted.validation->coverage.share) * channel);
  return color;
}

ColoredMesh
meshOf(const std::vector<ExtractedPatch>& patches, const Eigen::Vector3d& offset)
{
  ColoredMesh all;
  for (const ExtractedPatch& extracted : patches) {
    const Patch& patch = extracted.fit.patch;
    // Bounds are half-lengths; gamma, the last of the five, is an angle.
    const double length = 2.0 * patch.d.head<4>().maxCoeff();
    const Mesh mesh = tessellate(patch, length / 8.0);
    const auto first = static_cast<std::int32_t>(all.vertices.size());
    for (const Eigen::Vector3d& vertex : mesh.vertices)
      all.vertices.push_back(vertex + offset);
    all.colors.resize(all.vertices.size(), shadedColor(extracted));
    for (const auto& t : mesh.triangles)
      all.triangles.push_back({first + t[0], first + t[1], first + t[2]});
  }
  return all;
}

template <typename T>
void
writeRaw(std::ostream& out, const T* values, std::size_t n)
{
  out.write(reinterpret_cast<const char*>(values),
            static_cast<std::streamsize>(n * sizeof(T)));
}

void
writeMeshText(std::ostream& out, const ColoredMesh& mesh, bool in_double)
{
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    const Eigen::Vector3d& vertex = mesh.vertices[i];
    const Eigen::Vector3d v =
        in_double ? vertex : vertex.cast<float>().cast<double>().eval();
    const auto& color = mesh.colors[i];
    // Digits that give the value back in the precision it is read with.
    const int digits = in_double ? 17 : 9;
    out << fmt::format("{:.{}g} {:.{}g} {:.{}g} {} {} {}\n",
                       v.x(),
                       digits,
                       v.y(),
                       digits,
                       v.z(),
                       digits,
                       color[0],
                       color[1],
                       color[2]);
  }
  for (const auto& t : mesh.triangles)
    out << fmt::format("3 {} {} {}\n", t[0], t[1], t[2]);
}

void
writeMeshBinary(std::ostream& out, const ColoredMesh& mesh, bool in_double)
{
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    const Eigen::Vector3f single = mesh.vertices[i].cast<float>();
    if (in_double)
      writeRaw(out, mesh.vertices[i].data(), 3);
    else
      writeRaw(out, single.data(), 3);
    writeRaw(out, mesh.colors[i].data(), 3);
  }
  for (const auto& t : mesh.triangles) {
    out.put('\3');
    writeRaw(out, t.data(), 3);
  }
}

} // namespace

void
writeJson(std::ostream& out, const PatchReport& report, JsonLayout layout)
{
  const bool one_line = layout == JsonLayout::OneLine;
  const std::string_view gap = one_line ? "" : "\n";
  const auto member = [&](const char* name, const Json& value) {
    out << '"' << name << "\":" << text(value) << ',' << gap;
  };
  out << '{' << gap;
  member("holdfast", HOLDFAST_VERSION);
  member("schema", kSchema);
  if (!report.fingerprint.empty())
    member("fingerprint", report.fingerprint);
  member("cloud", report.cloud);
  if (report.map)
    member("is_map", true);
  if (report.timestamp_us)
    member("timestamp_us", *report.timestamp_us);
  if (report.file)
    member("input", io::inputJson(*report.file));
  member("sensor", sensorJson(report));
  member("offset", vectorJson(report.offset));
  member("cloud_points", pointsJson(report.result.points));
  member("notices", report.result.notices);
  member("options", optionsJson(report));
  out << "\"patches\":[" << gap;
  writePatches(out, report, one_line ? "," : ",\n");
  out << gap << "]," << gap;
  member("rejected", rejectedJson(report.result));
  out << "\"timing\":" << text(timingJson(report)) << gap << "}\n";
}

namespace {

/// In the frame of the points.
Pose
sensorPoseFrom(const Json& json, const Eigen::Vector3d& offset)
{
  std::array<double, 3> c = json.at("position");
  std::array<double, 4> q = json.at("orientation_wxyz");
  const Eigen::Quaterniond turn(q[0], q[1], q[2], q[3]);
  if (!(turn.norm() > 0.5))
    throw std::runtime_error("no result of holdfast: its sensor has no orientation");
  return {turn.normalized().toRotationMatrix(),
          Eigen::Vector3d(c[0], c[1], c[2]) - offset};
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
      for (std::size_t i = 0; i < 3; ++i)
        report.offset(static_cast<Eigen::Index>(i)) = offset->at(i);
    if (split)
      report.result.patches = readPatches(split->elements, containment, report.offset);
    else
      for (const Json& patch : json.at("patches"))
        report.result.patches.push_back(readPatch(patch, containment, report.offset));
    if (const auto input = json.find("input"); input != json.end())
      report.file = io::inputFromJson(*input);
    if (const auto sensor = json.find("sensor"); sensor != json.end())
      report.sensor_pose = sensorPoseFrom(*sensor, report.offset);
    readRejected(json.at("rejected"), report.result);
    return report;
  }
  catch (const Json::exception& error) {
    throw std::runtime_error(std::string("no result of holdfast: ") + error.what());
  }
}

void
writeMesh(std::ostream& out,
          const std::vector<ExtractedPatch>& patches,
          bool ascii,
          const Eigen::Vector3d& offset)
{
  const ColoredMesh mesh = meshOf(patches, offset);
  // What was shifted to fit into float does not fit into it.
  const bool in_double = !offset.isZero(0.0);
  out << fmt::format(
      "ply\nformat {0} 1.0\ncomment bounded patches, coloured by surface type\n"
      "element vertex {1}\nproperty {3} x\nproperty {3} y\nproperty {3} z\n"
      "property uchar red\nproperty uchar green\nproperty uchar blue\n"
      "element face {2}\nproperty list uchar int vertex_indices\nend_header\n",
      ascii ? "ascii" : "binary_little_endian",
      mesh.vertices.size(),
      mesh.triangles.size(),
      in_double ? "double" : "float");
  if (ascii)
    writeMeshText(out, mesh, in_double);
  else
    writeMeshBinary(out, mesh, in_double);
}

namespace {

void
writePatchCloud(std::ostream& out,
                const pcl::PointCloud<PatchPoint>& cloud,
                const Eigen::Vector3d& offset)
{
  pcl::PCLPointCloud2 fields;
  pcl::toPCLPointCloud2(cloud, fields);
  if (!offset.isZero(0.0))
    out << fmt::format("# add {} {} {} m to x y z: single precision cannot hold them\n",
                       offset.x(),
                       offset.y(),
                       offset.z());
  io::writePcdCompressed(out, fields, cloud.sensor_origin_, cloud.sensor_orientation_);
}

} // namespace

void
writePatchPoints(std::ostream& out,
                 const std::vector<ExtractedPatch>& patches,
                 const Pose& sensor_pose,
                 const Eigen::Vector3d& offset)
{
  writePatchCloud(out, toPatchCloud(patches, sensor_pose), offset);
}

void
writePatchPoints(std::ostream& out,
                 const DenseExtraction& dense,
                 const Pose& sensor_pose,
                 const Eigen::Vector3d& offset)
{
  writePatchCloud(out, toPatchCloud(dense, sensor_pose), offset);
}

std::array<std::uint8_t, 3>
surfaceColor(SurfaceType surface)
{
  // Okabe and Ito's palette, which colour-blind people can tell apart; in the order of
  // SurfaceType.
  using Color = std::array<std::uint8_t, 3>;
  constexpr std::array kColors{Color{153, 153, 153},
                               Color{240, 228, 66},
                               Color{204, 121, 167},
                               Color{0, 114, 178},
                               Color{213, 94, 0},
                               Color{0, 158, 115},
                               Color{86, 180, 233}};
  static_assert(kColors.size() == kSurfaceTraits.size(), "every surface has a colour");
  return kColors.at(static_cast<std::size_t>(surface));
}

} // namespace holdfast
