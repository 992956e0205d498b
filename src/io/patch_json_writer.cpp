#include "input_json.h"
#include "json_parts.h"
#include "json_text.h"
#include "patch_json.h"

#include "parallel/parallel_for.h"

#include <holdfast/fit/names.h>
#include <holdfast/io/patch_io.h>
#include <holdfast/pcl/names.h>
#include <holdfast/validation/names.h>
#include <holdfast/version.h>

#include <algorithm>
#include <array>
#include <string>
#include <string_view>

namespace holdfast {
namespace {

using Json = nlohmann::ordered_json;

/// What the covariances of the points came from.
std::string
noiseName(const PatchReport& report)
{
  return report.covariances_of_cloud ? "covariances of the cloud" :
         report.result.sensor.noise  ? report.result.sensor.noise->name() :
                                       "none";
}

Json
sensorJson(const PatchReport& report)
{
  const Sensor& sensor = report.result.sensor;
  Json json = {{"name", sensor.name},
               {"noise", noiseName(report)},
               {"pattern", io::patternJson(sensor.pattern)},
               {"camera", io::cameraJson(sensor.camera)}};
  json.update(io::poseJson(report.sensor_pose, report.offset));
  json["viewpoint_credible"] = report.result.viewpoint_is_credible;
  return json;
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
  member("schema", io::kPatchJsonSchema);
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
  member("offset", io::vectorJson(report.offset));
  member("cloud_points", io::pointsJson(report.result.points));
  member("notices", report.result.notices);
  member("options", optionsJson(report));
  out << "\"patches\":[" << gap;
  writePatches(out, report, one_line ? "," : ",\n");
  out << gap << "]," << gap;
  member("rejected", rejectedJson(report.result));
  out << "\"timing\":" << text(timingJson(report)) << gap << "}\n";
}

} // namespace holdfast
