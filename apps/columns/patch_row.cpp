#include "patch_row.h"

#include <holdfast/fit/names.h>
#include <holdfast/io/patch_io.h>

#include <nlohmann/json.hpp>

#include <sstream>
#include <stdexcept>
#include <type_traits>

namespace holdfast::app {
namespace {

using Json = nlohmann::ordered_json;

static_assert(std::is_trivially_copyable_v<PatchRow>, "rows are kept as bytes");

template <std::size_t n, typename Derived>
void
copyTo(std::array<double, n>& out, const Eigen::MatrixBase<Derived>& vector)
{
  for (Eigen::Index i = 0; i < vector.size(); ++i)
    out.at(static_cast<std::size_t>(i)) = vector(i);
}

void
addEstimate(const FitResult& fit, const Eigen::Vector3d& offset, PatchRow& row)
{
  Patch in_file = fit.patch;
  in_file.c += offset;
  PatchState state = fit.state;
  state.centre += offset;
  copyTo(row.parameters, pack(in_file));
  copyTo(row.state, pack(state));
  copyTo(row.centre, state.centre);
  const Eigen::Matrix3d frame = state.frame();
  copyTo(row.normal, frame.col(2));
  copyTo(row.x_axis, frame.col(0));
  std::size_t k = 0;
  for (Eigen::Index i = 0; i < fit.state_covariance.rows(); ++i)
    for (Eigen::Index j = 0; j <= i; ++j)
      row.state_covariance.at(k++) = fit.state_covariance(i, j);
  row.surface = static_cast<std::uint8_t>(fit.patch.type.surface);
  row.boundary = static_cast<std::uint8_t>(fit.patch.type.boundary);
}

void
addValidation(const Validation& validation, PatchRow& row)
{
  row.verdict = static_cast<std::uint8_t>(validation.verdict);
  row.residual_rms = static_cast<float>(validation.residual.rms_m);
  row.residual_largest = static_cast<float>(validation.residual.largest_m);
  row.residual_unexplained = static_cast<float>(validation.residual.unexplained_m);
  row.coverage = static_cast<float>(validation.coverage.share);
  row.extent = static_cast<float>(validation.extent_m);
  row.sagitta = static_cast<float>(validation.sagitta_m);
  row.curvature = static_cast<float>(validation.curvature_per_m);
  row.noise = static_cast<float>(validation.noise_m);
  row.view_angle = static_cast<float>(validation.view_angle_rad.value_or(kNoNumber));
  row.stray = static_cast<float>(validation.stray_share.value_or(kNoNumber));
}

template <std::size_t n>
void
readNumbers(const Json& json, std::array<double, n>& out)
{
  for (std::size_t i = 0; i < n; ++i)
    out[i] = json.at(i).is_null() ? kNoNumber : json.at(i).get<double>();
}

} // namespace

PatchRow
rowOf(const ExtractedPatch& patch, const Eigen::Vector3d& offset)
{
  const FitResult& fit = patch.fit;
  PatchRow row;
  addEstimate(fit, offset, row);
  row.status = static_cast<std::uint8_t>(fit.status);
  row.chi2 = fit.chi2;
  row.chi2_expected = fit.chi2_expected;
  row.chi2_dof = fit.chi2_dof;
  row.nonlinearity = static_cast<float>(fit.nonlinearity);
  row.points = fit.points;
  row.uninformative_points = fit.uninformative_points;
  row.iterations = fit.iterations;
  for (std::size_t i = 0; i < kFitFlagNames.size(); ++i)
    if (fit.flags.*kFitFlagNames[i].flag)
      row.flags = static_cast<std::uint8_t>(row.flags | (1U << i));
  row.second_attempt = patch.is_second_attempt ? 1 : 0;
  if (patch.seed_index) {
    row.seed_index = *patch.seed_index;
    copyTo(row.seed, patch.seed + offset);
  }
  if (patch.radius_m > 0.0)
    row.radius = static_cast<float>(patch.radius_m);
  if (patch.validation)
    addValidation(*patch.validation, row);
  return row;
}

CloudRow
cloudRowOf(const std::string& name, const std::string& json)
{
  try {
    const Json head = Json::parse(json);
    CloudRow row;
    row.name = name;
    row.path = head.at("cloud");
    row.fingerprint = head.value("fingerprint", "");
    Json sensor = head.at("sensor");
    readNumbers(sensor.at("position"), row.position);
    readNumbers(sensor.at("orientation_wxyz"), row.orientation_wxyz);
    readNumbers(head.at("offset"), row.offset);
    for (const char* of_cloud : {"position", "orientation_wxyz", "viewpoint_credible"})
      sensor.erase(of_cloud);
    const Json settings = {{"holdfast", head.at("holdfast")},
                           {"sensor", sensor},
                           {"options", head.at("options")}};
    row.settings = settings.dump();
    return row;
  }
  catch (const Json::exception& error) {
    throw std::runtime_error(std::string("no result of holdfast fit: ") + error.what());
  }
}

CloudRow
cloudRowOf(const std::string& name, const PatchReport& report)
{
  PatchReport head; // all but the patches, of which a copy would be large
  head.cloud = report.cloud;
  head.fingerprint = report.fingerprint;
  head.sensor_pose = report.sensor_pose;
  head.offset = report.offset;
  head.options = report.options;
  head.covariances_of_cloud = report.covariances_of_cloud;
  head.whole = report.whole;
  head.result.sensor = report.result.sensor;
  std::ostringstream json;
  json.imbue(std::locale::classic());
  writeJson(json, head, JsonLayout::OneLine);
  CloudRow row = cloudRowOf(name, json.str());
  row.patches = report.result.patches.size();
  return row;
}

} // namespace holdfast::app
