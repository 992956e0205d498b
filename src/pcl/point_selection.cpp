#include "point_selection.h"

#include "pixel_grid.h"
#include "unused_points.h"
#include "view_check.h"

#include <holdfast/geometry/gaussian.h>
#include <holdfast/pcl/intrinsics.h>
#include <holdfast/sensor/constant_noise_model.h>

#include <pcl/common/point_tests.h>

#include <fmt/core.h>

#include <algorithm>
#include <cstdint>
#include <limits>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

namespace holdfast {
namespace {

/// Standard deviation assumed where the sensor's model cannot hold, m.
constexpr double kUnknownSigma = 1e-3;

void
requireUsable(const RangeCloud& cloud, const Sensor& sensor)
{
  if (const std::string error = validityError(cloud); !error.empty())
    throw std::invalid_argument(error);
  if (!sensor.noise && !cloud.hasCovariances())
    throw std::invalid_argument(
        "the cloud has no covariances, and the sensor no noise model");
}

/// Most matrices are positive definite, which three minors show; the eigenvalues decide
/// the rest.
bool
isCovariance(const Eigen::Matrix3d& S)
{
  if (!S.allFinite())
    return false;
  const double minor = S(0, 0) * S(1, 1) - S(0, 1) * S(1, 0);
  return (S(0, 0) > 0.0 && minor > 0.0 && S.determinant() > 0.0 &&
          S.isApprox(S.transpose())) ||
         isPositiveSemiDefinite(S);
}

void
dropInvalidCovariances(const RangeCloud& cloud, UnusedPoints& unused)
{
  if (!cloud.hasCovariances())
    return;
  const Covariances& covariances = *cloud.covariances;
  for (std::size_t i = 0; i < covariances.size(); ++i)
    if (!isCovariance(covariances[i].cast<double>()))
      unused.drop(i, &PointAccounting::invalid_covariance);
}

/// True when some pixel has the point of the one before it or above it, as in images
/// that were enlarged.
bool
repeatsPixels(const pcl::PointCloud<pcl::PointXYZ>& points)
{
  constexpr std::uint32_t kStep = 7; // rows: enough, and of either parity
  for (std::uint32_t v = 1; v < points.height; v += kStep)
    for (std::uint32_t u = 1; u < points.width; ++u)
      if (isSamePlace(points(u, v), points(u - 1, v)) ||
          isSamePlace(points(u, v), points(u, v - 1)))
        return true;
  return false;
}

/// The pixels of an image are seen along different rays, so none repeats another.
bool
isImage(const RangeCloud& cloud, const Sensor& sensor)
{
  if (cloud.points->height < 2 || repeatsPixels(*cloud.points))
    return false;
  const auto residual = pixelResidual(cloud, sensor.camera);
  return (residual && *residual <= kMaxResidualPx) || recoverIntrinsics(cloud);
}

/// Without rows and columns: neighbours among them are not neighbours any more.
RangeCloud
withoutGrid(RangeCloud cloud)
{
  auto points = pcl::make_shared<pcl::PointCloud<pcl::PointXYZ>>(*cloud.points);
  points->width = static_cast<std::uint32_t>(points->size());
  points->height = 1;
  cloud.points = points;
  return cloud;
}

/// True for a spinning scanner, whose clouds are around it. Constant noise is that of
/// no sensor.
bool
looksAround(const NoiseModel& noise)
{
  return noise.isOmnidirectional() &&
         dynamic_cast<const ConstantNoiseModel*>(&noise) == nullptr;
}

void
noteDuplicates(PointSelection& selection)
{
  const PointAccounting& points = selection.points;
  if (points.duplicate == 0)
    return;
  const int distinct = points.used + points.duplicate;
  selection.notices.push_back(fmt::format(
      "{} of {} points ({} %) lie exactly where others do: each place counts once",
      points.duplicate,
      distinct,
      100LL * points.duplicate / distinct));
}

/// Duplicates have a notice of their own.
void
noteLeftOut(PointSelection& selection)
{
  PointAccounting others = selection.points;
  others.used += others.duplicate;
  others.duplicate = 0;
  if (const std::string text = leftOutText(others); !text.empty())
    selection.notices.push_back(text);
}

} // namespace

PointSelection
selectPoints(const RangeCloud& cloud, const Sensor& nominal)
{
  requireUsable(cloud, nominal);
  PointSelection selection;
  selection.sensor =
      nominal.noise ? nominal : withConstantNoise(nominal, kUnknownSigma);
  const bool has_model = !cloud.hasCovariances() && nominal.noise;
  const bool model_asked = has_model && !nominal.noise->isOmnidirectional();
  const ViewCheck view(cloud, selection.sensor);
  UnusedPoints unused(cloud);
  if (model_asked && view.isForeign()) {
    selection.notices.push_back(view.foreignNotice());
    selection.sensor = withConstantNoise(nominal, kUnknownSigma);
    selection.noise_is_assumed = true;
  }
  else if (model_asked) {
    view.dropUnseen(unused);
    if (const std::string hint = view.hint(); !hint.empty())
      selection.notices.push_back(hint);
  }
  dropInvalidCovariances(cloud, unused);
  if (!isImage(cloud, nominal))
    unused.dropDuplicates();
  selection.viewpoint_is_credible =
      cloud.sensor_pose_given || (has_model && looksAround(*nominal.noise)) ||
      !(model_asked ? view.isForeign() : view.isAllAround());
  selection.cloud = unused.usedCloud();
  selection.points = unused.accounting();
  if (selection.points.duplicate > 0 && cloud.points->height > 1)
    selection.cloud = withoutGrid(selection.cloud);
  noteDuplicates(selection);
  noteLeftOut(selection);
  return selection;
}

PointAccounting&
PointAccounting::operator+=(const PointAccounting& other)
{
  for (int PointAccounting::*count : {&PointAccounting::in_cloud,
                                      &PointAccounting::invalid,
                                      &PointAccounting::behind_camera,
                                      &PointAccounting::out_of_view,
                                      &PointAccounting::invalid_covariance,
                                      &PointAccounting::duplicate,
                                      &PointAccounting::used})
    this->*count += other.*count;
  return *this;
}

std::string
leftOutText(const PointAccounting& points)
{
  const int left_out = points.valid() - points.used;
  if (left_out == 0)
    return {};
  std::string reasons;
  const auto add = [&reasons](int count, const char* reason) {
    if (count > 0)
      reasons += fmt::format("{}{} {}", reasons.empty() ? "" : ", ", count, reason);
  };
  add(points.behind_camera, "behind the camera");
  add(points.out_of_view, "out of the sensor's view or range");
  add(points.invalid_covariance, "with a covariance that is none");
  add(points.duplicate, "duplicates");
  return fmt::format("{} of {} points are left out: {}",
                     left_out,
                     points.valid(),
                     reasons);
}

} // namespace holdfast
