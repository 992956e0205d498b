#include <holdfast/pcl/conversions.h>

#include <holdfast/fit/names.h>
#include <holdfast/validation/names.h>

#include "zero_points.h"

#include <holdfast/geometry/constants.h>

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace holdfast {

namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

/// Calls use(i, j, slot) for the upper triangle of an n x n matrix, row by row.
template <typename Use>
void
forUpperTriangle(Eigen::Index n, Use&& use)
{
  int slot = 0;
  for (Eigen::Index i = 0; i < n; ++i)
    for (Eigen::Index j = i; j < n; ++j)
      use(i, j, slot++);
}

void
writeNumbers(const FitResult& fit, PatchPoint& point)
{
  point.getVector3fMap() = fit.patch.c.cast<float>();
  point.getNormalVector3fMap() = fit.patch.normal().cast<float>();
  const ParameterVector parameters = pack(fit.patch);
  std::transform(parameters.begin(), parameters.end(), point.parameters, [](double p) {
    return static_cast<float>(p);
  });
  const ParameterMatrix observable = observableCovariance(fit);
  forUpperTriangle(observable.rows(), [&](auto i, auto j, int slot) {
    point.parameter_covariance[slot] = static_cast<float>(observable(i, j));
  });
  const StateVector state = pack(fit.state);
  std::transform(state.begin(), state.end(), point.state, [](double x) {
    return static_cast<float>(x);
  });
  forUpperTriangle(fit.state_covariance.rows(), [&](auto i, auto j, int slot) {
    point.state[PatchPoint::kStateCovariance + slot] =
        static_cast<float>(fit.state_covariance(i, j));
  });
}

int
bitsOf(const FitFlags& flags)
{
  int bits = 0;
  for (std::size_t i = 0; i < kFitFlagNames.size(); ++i)
    bits |= static_cast<int>(flags.*kFitFlagNames[i].flag) << i;
  return bits;
}

FitFlags
flagsOf(int bits)
{
  FitFlags flags;
  for (std::size_t i = 0; i < kFitFlagNames.size(); ++i)
    flags.*kFitFlagNames[i].flag = ((bits >> i) & 1) != 0;
  return flags;
}

// Clouds of former versions have no state: there it is that of the parameters, as if
// bounded with the default containment, and has no covariance.
void
readState(const PatchPoint& point, FitResult& fit)
{
  fit.state = toState(fit.patch, FitOptions{}.containment);
  const Eigen::Index n = stateLayoutOf(fit.patch.type).size();
  if (point.state[PatchPoint::kStateCovariance] == 0.0F)
    return;
  StateVector state(n);
  std::copy_n(point.state, n, state.begin());
  fit.state =
      unpackState(fit.patch.type, state, point.getNormalVector3fMap().cast<double>());
  fit.state_covariance.resize(n, n);
  forUpperTriangle(n, [&](auto i, auto j, int slot) {
    fit.state_covariance(i, j) = fit.state_covariance(j, i) =
        point.state[PatchPoint::kStateCovariance + slot];
  });
}

void
writeNaN(PatchPoint& point)
{
  point.getVector3fMap().setConstant(kNaN);
  point.getNormalVector3fMap().setConstant(kNaN);
  std::fill(std::begin(point.parameters), std::end(point.parameters), kNaN);
  std::fill(std::begin(point.parameter_covariance),
            std::end(point.parameter_covariance),
            kNaN);
  std::fill_n(point.state, PatchPoint::kChi2Expected, kNaN);
}

void
writeValidation(const ExtractedPatch& patch, PatchPoint& point)
{
  const bool usable = isUsable(patch.fit.status);
  const auto& validation = patch.validation;
  const bool measured = usable && validation;
  point.residual = measured ? static_cast<float>(validation->residual.rms_m) : kNaN;
  point.coverage = measured ? static_cast<float>(validation->coverage.share) : kNaN;
  point.verdict = static_cast<std::uint8_t>(measured ? validation->verdict :
                                            usable   ? PatchVerdict::Accepted :
                                                       PatchVerdict::NotUsable);
}

void
readValidation(const PatchPoint& point, ExtractedPatch& patch)
{
  if (std::isnan(point.coverage))
    return;
  Validation& validation = patch.validation.emplace();
  validation.verdict = static_cast<PatchVerdict>(point.verdict);
  validation.residual.rms_m = point.residual;
  validation.coverage.share = point.coverage;
}

void
readNumbers(const PatchPoint& point, PatchType type, FitResult& fit)
{
  const Eigen::Index n = degreesOfFreedom(type);
  ParameterVector parameters(n);
  std::copy_n(point.parameters, n, parameters.begin());
  fit.patch = unpack(type, parameters);
  // The single-precision number nearest to pi lies above it, where no |r| may be.
  if (const double angle = fit.patch.r.norm(); angle > kPi)
    fit.patch.r *= kPi / angle;
  fit.covariance.resize(n, n);
  forUpperTriangle(n, [&](auto i, auto j, int slot) {
    fit.covariance(i, j) = fit.covariance(j, i) = point.parameter_covariance[slot];
  });
}

} // namespace

Pose
sensorPose(const Eigen::Vector4f& sensor_origin,
           const Eigen::Quaternionf& sensor_orientation)
{
  const Eigen::Quaterniond q = sensor_orientation.cast<double>();
  Pose pose;
  if (q.norm() > 0.0)
    pose.R = q.normalized().toRotationMatrix();
  pose.c = sensor_origin.head<3>().cast<double>();
  return pose;
}

namespace detail {

pcl::PointCloud<pcl::PointXYZ>::ConstPtr
withoutZeroPoints(const pcl::PointCloud<pcl::PointXYZ>::ConstPtr& points,
                  const Pose& sensor_pose,
                  int& count)
{
  const auto isZero = [](const pcl::PointXYZ& p) {
    return p.x == 0.0F && p.y == 0.0F && p.z == 0.0F;
  };
  if (!points || std::none_of(points->begin(), points->end(), isZero))
    return points;
  const auto cleaned = pcl::make_shared<pcl::PointCloud<pcl::PointXYZ>>(*points);
  count = invalidateZeroPoints(*cleaned, sensor_pose);
  return cleaned;
}

void
noteZeroPoints(int count, std::string* notice)
{
  if (count == 0 || notice == nullptr)
    return;
  if (!notice->empty())
    *notice += "; ";
  *notice += fmt::format("{} at the sensor {} taken as invalid",
                         count == 1 ? "1 point" : fmt::format("{} points", count),
                         count == 1 ? "is" : "are");
}

} // namespace detail

PointImage
toPointImage(const RangeCloud& cloud)
{
  PointImage image;
  image.width = static_cast<int>(cloud.points->width);
  image.height = static_cast<int>(cloud.points->height);
  image.points.reserve(cloud.points->size());
  for (const pcl::PointXYZ& point : *cloud.points) {
    const Eigen::Vector3d q = point.getVector3fMap().cast<double>();
    image.points.push_back(cloud.sensor_pose.toLocal(q).cast<float>());
  }
  return image;
}

pcl::PointCloud<PointXYZCovariance>
toPointCloud(const RangeCloud& cloud)
{
  pcl::PointCloud<PointXYZCovariance> points;
  pcl::copyPointCloud(*cloud.points, points);
  if (cloud.hasCovariances())
    for (std::size_t i = 0; i < points.size(); ++i)
      points[i].setCovariance((*cloud.covariances)[i]);
  writeSensorPose(cloud.sensor_pose, points);
  return points;
}

PatchPoint
toPatchPoint(const ExtractedPatch& patch)
{
  const FitResult& fit = patch.fit;
  PatchPoint point;
  if (isAccepted(patch))
    writeNumbers(fit, point);
  else
    writeNaN(point);
  writeValidation(patch, point);
  point.chi2 = static_cast<float>(fit.chi2);
  point.chi2_dof = fit.chi2_dof;
  point.state[PatchPoint::kChi2Expected] = static_cast<float>(fit.chi2_expected);
  point.state[PatchPoint::kNonlinearity] = static_cast<float>(fit.nonlinearity);
  point.state[PatchPoint::kFlags] = static_cast<float>(bitsOf(fit.flags));
  point.points = fit.points;
  point.seed = patch.seed_index.value_or(-1);
  point.radius = static_cast<float>(patch.radius_m);
  point.surface = static_cast<std::uint8_t>(fit.patch.type.surface);
  point.boundary = static_cast<std::uint8_t>(fit.patch.type.boundary);
  point.status = static_cast<std::uint8_t>(fit.status);
  return point;
}

ExtractedPatch
toExtractedPatch(const PatchPoint& point)
{
  ExtractedPatch patch;
  FitResult& fit = patch.fit;
  const PatchType type{static_cast<SurfaceType>(point.surface),
                       static_cast<BoundaryType>(point.boundary)};
  if (!isLegal(type) || point.status > static_cast<int>(FitStatus::NonFinite) ||
      point.verdict >= kVerdictNames.words.size())
    throw std::invalid_argument(
        "holdfast::toExtractedPatch: no patch type, status or verdict");
  fit.status = static_cast<FitStatus>(point.status);
  fit.patch.type = type;
  readValidation(point, patch);
  if (isAccepted(patch))
    readNumbers(point, type, fit);
  if (isAccepted(patch))
    readState(point, fit);
  fit.chi2 = point.chi2;
  fit.chi2_dof = point.chi2_dof;
  // Not in clouds of former versions, which knew independent errors only.
  fit.chi2_expected = point.state[PatchPoint::kChi2Expected] > 0.0F ?
                          point.state[PatchPoint::kChi2Expected] :
                          fit.chi2_dof;
  fit.nonlinearity = point.state[PatchPoint::kNonlinearity];
  fit.flags = flagsOf(static_cast<int>(point.state[PatchPoint::kFlags]));
  fit.points = point.points;
  if (point.seed >= 0)
    patch.seed_index = point.seed;
  patch.radius_m = point.radius;
  return patch;
}

pcl::PointCloud<PatchPoint>
toPatchCloud(const std::vector<ExtractedPatch>& patches, const Pose& sensor_pose)
{
  pcl::PointCloud<PatchPoint> cloud;
  cloud.reserve(patches.size());
  for (const ExtractedPatch& patch : patches)
    cloud.push_back(toPatchPoint(patch));
  cloud.is_dense = std::all_of(patches.begin(), patches.end(), isAccepted);
  writeSensorPose(sensor_pose, cloud);
  return cloud;
}

} // namespace holdfast
