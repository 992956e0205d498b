#include "report/page_data.h"

#include "report/binary_block.h"
#include "report/page_template.h"
#include "report/point_share.h"
#include "report/risk_data.h"

#include <holdfast/fit/names.h>
#include <holdfast/geometry/constants.h>
#include <holdfast/patch/boundary.h>
#include <holdfast/patch/tessellation.h>
#include <holdfast/validation/names.h>
#include <holdfast/version.h>

#include <fmt/core.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <stdexcept>
#include <string_view>

namespace holdfast::app {
namespace {

using Json = nlohmann::json;

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr double kPieces = 6.0; // of a mesh along a patch's length

/// A number of a patch that the table can show.
struct Column {
  const char* name;
  double (*value)(const ExtractedPatch&);
};

template <double Validation::*member>
double
validationValue(const ExtractedPatch& patch)
{
  return patch.validation ? (*patch.validation).*member : kNone;
}

const Column kColumns[] = {
    {"points", [](const ExtractedPatch& p) { return double(p.fit.points); }},
    {"chi2_per_dof", [](const ExtractedPatch& p) { return chi2PerDof(p.fit); }},
    {"sigma_centre", [](const ExtractedPatch& p) { return centreSigma(p.fit); }},
    {"sigma_normal", [](const ExtractedPatch& p) { return normalSigma(p.fit); }},
    {"area",
     [](const ExtractedPatch& p) {
       return hasShape(p) ? projectedArea(p.fit.patch) : kNone;
     }},
    {"radius", [](const ExtractedPatch& p) { return p.radius_m; }},
    {"chi2", [](const ExtractedPatch& p) { return p.fit.chi2; }},
    {"chi2_dof", [](const ExtractedPatch& p) { return double(p.fit.chi2_dof); }},
    {"chi2_expected", [](const ExtractedPatch& p) { return p.fit.chi2_expected; }},
    {"uninformative_points",
     [](const ExtractedPatch& p) { return double(p.fit.uninformative_points); }},
    {"iterations", [](const ExtractedPatch& p) { return double(p.fit.iterations); }},
    {"nonlinearity", [](const ExtractedPatch& p) { return p.fit.nonlinearity; }},
    {"second_attempt",
     [](const ExtractedPatch& p) { return double(p.is_second_attempt); }},
    {"residual_rms",
     [](const ExtractedPatch& p) {
       return p.validation ? p.validation->residual.rms_m : kNone;
     }},
    {"residual_largest",
     [](const ExtractedPatch& p) {
       return p.validation ? p.validation->residual.largest_m : kNone;
     }},
    {"residual_unexplained",
     [](const ExtractedPatch& p) {
       return p.validation ? p.validation->residual.unexplained_m : kNone;
     }},
    {"coverage",
     [](const ExtractedPatch& p) {
       return p.validation ? p.validation->coverage.share : kNone;
     }},
    {"extent", validationValue<&Validation::extent_m>},
    {"sagitta", validationValue<&Validation::sagitta_m>},
    {"curvature", validationValue<&Validation::curvature_per_m>},
    {"noise", validationValue<&Validation::noise_m>},
    {"view_angle",
     [](const ExtractedPatch& p) {
       return p.validation ? p.validation->view_angle_rad.value_or(kNone) : kNone;
     }},
    {"stray",
     [](const ExtractedPatch& p) {
       return p.validation ? p.validation->stray_share.value_or(kNone) : kNone;
     }},
};

template <typename Vector>
Json
arrayOf(const Vector& v)
{
  return {v[0], v[1], v[2]};
}

void
append(std::vector<float>& numbers, const Eigen::Ref<const Eigen::VectorXd>& vector)
{
  for (Eigen::Index i = 0; i < vector.size(); ++i)
    numbers.push_back(static_cast<float>(vector[i]));
}

/// The upper triangle, row by row; NaN for a matrix that is not there.
void
appendSymmetric(std::vector<float>& numbers,
                const Eigen::Ref<const Eigen::MatrixXd>& matrix,
                Eigen::Index n)
{
  for (Eigen::Index i = 0; i < n; ++i)
    for (Eigen::Index j = i; j < n; ++j)
      numbers.push_back(static_cast<float>(matrix.rows() == n ? matrix(i, j) : kNone));
}

void
appendTurn(std::vector<float>& numbers, const Eigen::Matrix3d& rotation)
{
  const Eigen::Quaterniond q(rotation);
  append(numbers, q.coeffs()); // x y z w
}

/// The meshes of patches about their centres. Steps are fractions of 1/32767 of the
/// patch's reach.
struct Meshes {
  std::vector<float> reach; ///< of each patch: largest coordinate, m
  std::vector<std::uint16_t> vertex_counts, triangle_counts, outline_counts;
  std::vector<std::int16_t> vertices; ///< x y z, world axes, in steps
  std::vector<std::uint16_t> triangles; ///< of the patch's own vertices
};

void
append(Meshes& meshes, const Patch& patch)
{
  const double spacing = 2.0 * patch.d.head<4>().maxCoeff() / kPieces;
  const Mesh mesh = tessellate(patch, spacing);
  double reach = 0.0;
  for (const Eigen::Vector3d& vertex : mesh.vertices)
    reach = std::max(reach, (vertex - patch.c).cwiseAbs().maxCoeff());
  for (const Eigen::Vector3d& vertex : mesh.vertices)
    for (const double coordinate : (vertex - patch.c).eval())
      meshes.vertices.push_back(
          static_cast<std::int16_t>(std::lround(32767.0 * coordinate / reach)));
  for (const auto& triangle : mesh.triangles)
    for (const int corner : triangle)
      meshes.triangles.push_back(static_cast<std::uint16_t>(corner));
  meshes.reach.push_back(static_cast<float>(reach));
  meshes.vertex_counts.push_back(static_cast<std::uint16_t>(mesh.vertices.size()));
  meshes.triangle_counts.push_back(static_cast<std::uint16_t>(mesh.triangles.size()));
  meshes.outline_counts.push_back(
      static_cast<std::uint16_t>(outline(patch, spacing).size()));
}

Json
meshesJson(const std::vector<ExtractedPatch>& patches, BinaryBlock& block)
{
  Meshes meshes;
  for (const ExtractedPatch& patch : patches)
    if (hasShape(patch))
      append(meshes, patch.fit.patch);
    else {
      meshes.reach.push_back(0.0F);
      for (auto* counts :
           {&meshes.vertex_counts, &meshes.triangle_counts, &meshes.outline_counts})
        counts->push_back(0);
    }
  return {{"reach", block.add(meshes.reach)},
          {"vertexCounts", block.add(meshes.vertex_counts)},
          {"triangleCounts", block.add(meshes.triangle_counts)},
          {"outlineCounts", block.add(meshes.outline_counts)},
          {"vertices", block.add(meshes.vertices)},
          {"triangles", block.add(meshes.triangles)}};
}

std::uint8_t
flagBits(const FitFlags& flags)
{
  unsigned bits = 0;
  for (std::size_t i = 0; i < kFitFlagNames.size(); ++i)
    bits |= static_cast<unsigned>(flags.*kFitFlagNames[i].flag) << i;
  return static_cast<std::uint8_t>(bits);
}

std::uint8_t
typeIndex(PatchType type)
{
  const auto* at = std::find(kPatchTypes.begin(), kPatchTypes.end(), type);
  return static_cast<std::uint8_t>(at - kPatchTypes.begin());
}

/// Type, status, verdict (255: none) and flags, a byte each.
Json
kindsJson(const std::vector<ExtractedPatch>& patches, BinaryBlock& block)
{
  std::vector<std::uint8_t> types, statuses, verdicts, flags;
  for (const ExtractedPatch& patch : patches) {
    types.push_back(typeIndex(patch.fit.patch.type));
    statuses.push_back(static_cast<std::uint8_t>(patch.fit.status));
    verdicts.push_back(
        patch.validation ? static_cast<std::uint8_t>(patch.validation->verdict) : 255);
    flags.push_back(flagBits(patch.fit.flags));
  }
  return {{"types", block.add(types)},
          {"statuses", block.add(statuses)},
          {"verdicts", block.add(verdicts)},
          {"flags", block.add(flags)}};
}

/// Parameters, their covariance, state, its covariance, and two rotations: of the
/// patch's frame and of the state's.
Json
estimatesJson(const std::vector<ExtractedPatch>& patches, BinaryBlock& block)
{
  std::vector<float> parameters, parameter_covariances, states, state_covariances;
  std::vector<float> turns, state_turns;
  for (const ExtractedPatch& patch : patches) {
    const FitResult& fit = patch.fit;
    append(parameters, pack(fit.patch));
    appendSymmetric(parameter_covariances,
                    fit.covariance,
                    degreesOfFreedom(fit.patch.type));
    append(states, pack(fit.state));
    appendSymmetric(state_covariances,
                    fit.state_covariance,
                    stateLayoutOf(fit.patch.type).size());
    appendTurn(turns, fit.patch.pose().R);
    appendTurn(state_turns, fit.state.frame());
  }
  return {{"parameters", block.add(parameters)},
          {"parameterCovariances", block.add(parameter_covariances)},
          {"states", block.add(states)},
          {"stateCovariances", block.add(state_covariances)},
          {"turns", block.add(turns)},
          {"stateTurns", block.add(state_turns)}};
}

bool
anyFinite(const std::vector<float>& numbers)
{
  return std::any_of(numbers.begin(), numbers.end(), [](float number) {
    return std::isfinite(number);
  });
}

/// Known without the fit.
bool
isOfShape(const Column& column)
{
  const std::string_view name = column.name;
  return name == "area" || name == "radius";
}

Json
columnsJson(const ReportResult& result, BinaryBlock& block)
{
  Json columns = Json::object();
  std::vector<float> numbers;
  for (const Column& column : kColumns) {
    if (!result.has_fits && !isOfShape(column))
      continue;
    numbers.clear();
    for (const ExtractedPatch& patch : result.report.result.patches)
      numbers.push_back(static_cast<float>(column.value(patch)));
    if (anyFinite(numbers))
      columns[column.name] = block.add(numbers);
  }
  std::set<std::string> extras;
  for (const Json& patch : result.extras)
    for (const auto& [name, ignored] : patch.items())
      extras.insert(name);
  for (const std::string& name : extras) {
    numbers.clear();
    for (const Json& patch : result.extras)
      numbers.push_back(static_cast<float>(patch.value(name, kNone)));
    columns[name] = block.add(numbers);
  }
  return columns;
}

Json
cloudJson(const ReportResult& result, std::size_t points, BinaryBlock& block)
{
  if (!result.cloud)
    return {{"note", result.cloud_note}};
  const PointShare share = shareOf(*result.cloud, points);
  std::vector<float> positions;
  for (const Eigen::Vector3d& position : share.positions)
    append(positions, position);
  return {{"file", result.cloud_file},
          {"of", result.cloud->points.positions.size()},
          {"spacing", share.spacing},
          {"colored", !result.cloud->points.colors.empty()},
          {"positions", block.add(positions)},
          {"colors", block.add(share.colors)}};
}

/// Where to look from first.
Json
viewJson(const ReportResult& result)
{
  constexpr double kAzimuth = 35.0 * kPi / 180.0, kElevation = 30.0 * kPi / 180.0;
  const SeenCloud seen = seenOf(result);
  const Standpoint standpoint = standpointOf(seen);
  return {{"seen", seen.seen},
          {"up", arrayOf(standpoint.up)},
          {"eye", arrayOf(seen.sensor_pose.c)},
          {"forward", arrayOf(seen.sensor_pose.R.col(2))},
          {"right", arrayOf(seen.sensor_pose.R.col(0))},
          {"aside", arrayOf(towardsEye(standpoint, kAzimuth, kElevation))}};
}

Json
resultJson(const ReportResult& result, std::size_t points, BinaryBlock& block)
{
  const std::vector<ExtractedPatch>& patches = result.report.result.patches;
  return {{"title", titleOf(result)},
          {"source", result.source},
          {"isMap", result.report.is_of_map},
          {"hasFits", result.has_fits},
          {"head", result.head},
          {"offset", arrayOf(result.report.offset)},
          {"patches", patches.size()},
          {"view", viewJson(result)},
          {"kinds", kindsJson(patches, block)},
          {"estimates", estimatesJson(patches, block)},
          {"columns", columnsJson(result, block)},
          {"meshes", meshesJson(patches, block)},
          {"risk", riskJson(result, block)},
          {"cloud", cloudJson(result, points, block)}};
}

Json
typesJson()
{
  Json types = Json::array();
  for (const PatchType& type : kPatchTypes) {
    const auto color = surfaceColor(type.surface);
    const StateLayout layout = stateLayoutOf(type);
    types.push_back(
        {{"surface", surfaceName(type.surface)},
         {"boundary", boundaryName(type.boundary)},
         {"color", fmt::format("#{:02x}{:02x}{:02x}", color[0], color[1], color[2])},
         {"parameters", parameterNames(type)},
         {"state", stateNames(type)},
         {"layout", {{"k", layout.k()}, {"nu", layout.nu()}, {"c", layout.c()}}}});
  }
  return types;
}

Json
flagNames()
{
  Json names = Json::array();
  for (const FitFlagName& flag : kFitFlagNames)
    names.push_back(flag.name);
  return names;
}

/// Of all clouds, where a page may show so many.
std::size_t
pointsShown(const std::vector<ReportResult>& results, std::size_t points)
{
  std::size_t shown = 0;
  for (const ReportResult& result : results)
    if (result.cloud)
      shown += std::min(result.cloud->points.positions.size(), points / results.size());
  return shown;
}

/// In a script element nothing may look like the end of it, or the start of a comment.
std::string
embeddable(const Json& json)
{
  const std::string text = json.dump(-1, ' ', true, Json::error_handler_t::replace);
  std::string escaped;
  escaped.reserve(text.size());
  for (const char c : text)
    if (c == '<')
      escaped += "\\u003c";
    else
      escaped += c;
  return escaped;
}

} // namespace

std::string
pageData(const std::vector<ReportResult>& results, std::size_t points)
{
  BinaryBlock block;
  Json list = Json::array();
  for (const ReportResult& result : results)
    list.push_back(resultJson(result, points / results.size(), block));
  return embeddable({{"version", HOLDFAST_VERSION},
                     {"types", typesJson()},
                     {"statuses", kStatusNames.words},
                     {"verdicts", kVerdictNames.words},
                     {"flags", flagNames()},
                     {"riskScale", riskScaleJson()},
                     {"results", list},
                     {"binary", block.base64()}});
}

std::string
reportPage(const std::vector<ReportResult>& results, std::size_t max_bytes)
{
  constexpr std::size_t kMostPoints = 50000, kLeastPoints = 5000;
  const std::string_view page = pageTemplate();
  const std::size_t at = page.find(kDataMark);
  if (at == std::string_view::npos)
    throw std::logic_error("the template of the page has no place for data");
  std::size_t points = kMostPoints;
  std::string data = pageData(results, points);
  const std::size_t fixed = page.size() + pageData(results, 0).size();
  while (page.size() + data.size() > max_bytes && points > kLeastPoints &&
         pointsShown(results, points) > 0) {
    const auto taken = static_cast<double>(page.size() + data.size() - fixed);
    const double room =
        std::max(0.0, static_cast<double>(max_bytes) - static_cast<double>(fixed));
    // Fewer points lie farther apart, and compress a little less.
    const double share = std::min(0.98, 0.97 * room / taken);
    const auto shown = static_cast<double>(pointsShown(results, points));
    points = std::max(kLeastPoints, static_cast<std::size_t>(share * shown));
    data = pageData(results, points);
  }
  std::string text(page.substr(0, at));
  return text.append(data).append(page.substr(at + kDataMark.size()));
}

} // namespace holdfast::app
