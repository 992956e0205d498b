#include "ros1/conversions.h"

#include "ros1/markers.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <map>
#include <stdexcept>
#include <utility>

namespace holdfast::robot {
namespace {

template <typename Matrix>
std::vector<double>
numbersOf(const Matrix& matrix)
{
  std::vector<double> numbers;
  numbers.reserve(static_cast<std::size_t>(matrix.size()));
  for (Eigen::Index row = 0; row < matrix.rows(); ++row)
    for (Eigen::Index column = 0; column < matrix.cols(); ++column)
      numbers.push_back(matrix(row, column));
  return numbers;
}

std::size_t
offsetOf(const sensor_msgs::PointCloud2& message, const std::string& name)
{
  for (const sensor_msgs::PointField& field : message.fields)
    if (field.name == name && field.datatype == sensor_msgs::PointField::FLOAT32)
      return field.offset;
  throw std::runtime_error("a cloud has no field " + name + " of 32-bit floats");
}

std::uint8_t
bitsOf(const FitFlags& flags)
{
  using holdfast_msgs::Patch;
  return static_cast<std::uint8_t>(
      (flags.axis_not_observable ? Patch::AXIS_NOT_OBSERVABLE : 0) |
      (flags.curvature_not_observable ? Patch::CURVATURE_NOT_OBSERVABLE : 0) |
      (flags.orientation_singular ? Patch::ORIENTATION_SINGULAR : 0));
}

holdfast_msgs::Patch
patchMessage(const AnswerPatch& answered)
{
  const FitResult& fit = answered.patch.fit;
  holdfast_msgs::Patch message;
  message.surface = static_cast<std::uint8_t>(fit.patch.type.surface);
  message.bounds = static_cast<std::uint8_t>(fit.patch.type.boundary);
  message.flags = bitsOf(fit.flags);
  message.pose = toMessage(fit.patch.pose());
  message.parameters = numbersOf(pack(fit.patch));
  message.covariance = numbersOf(observableCovariance(fit));
  message.state = numbersOf(pack(fit.state));
  message.state_covariance = numbersOf(fit.state_covariance);
  for (const Eigen::Vector3d& point : outlineOnSurface(fit.patch))
    message.boundary.push_back(toPoint(point));
  message.chi2 = fit.chi2;
  message.chi2_expected = fit.chi2_expected;
  message.points = static_cast<std::uint32_t>(fit.points);
  message.radius = static_cast<float>(answered.patch.radius_m);
  message.id = answered.id;
  message.views = static_cast<std::uint32_t>(answered.views);
  message.is_seen_now = answered.is_seen_now;
  return message;
}

/// Of (c, delta about fixed axes) from that of (delta about own axes, c).
boost::array<double, 36>
poseCovariance(const JetMatrix& covariance, const Eigen::Matrix3d& rotation)
{
  JetMatrix J = JetMatrix::Zero();
  J.topRightCorner<3, 3>().setIdentity();
  J.bottomLeftCorner<3, 3>() = rotation;
  const std::vector<double> numbers = numbersOf(J * covariance * J.transpose());
  boost::array<double, 36> result{};
  std::copy(numbers.begin(), numbers.end(), result.begin());
  return result;
}

holdfast_msgs::Foothold
footholdMessage(const Foothold& foothold)
{
  const ContactQuality& quality = *foothold.risk.quality;
  const ContactEvents& risk = quality.risk;
  holdfast_msgs::Foothold message;
  message.pose.pose = toMessage(quality.pose);
  message.pose.covariance = poseCovariance(quality.pose_covariance, quality.pose.R);
  message.risk_total = static_cast<float>(risk.total);
  message.risk_slip = static_cast<float>(risk.slip);
  message.risk_height = static_cast<float>(risk.height);
  message.risk_tilt = static_cast<float>(risk.tilt);
  message.risk_gap = static_cast<float>(risk.gap);
  message.risk_support = static_cast<float>(risk.support);
  message.contact_area = static_cast<float>(quality.contact_area_m2);
  message.cvar_gap = static_cast<float>(quality.cvar_gap_m);
  message.support_share = static_cast<float>(foothold.risk.support_share);
  message.views = static_cast<std::uint32_t>(foothold.views);
  return message;
}

std_msgs::Float32MultiArray
toArray(const std::vector<float>& values, int rows, int columns)
{
  std_msgs::Float32MultiArray array;
  array.layout.dim.resize(2);
  array.layout.dim[0].label = "column_index";
  array.layout.dim[0].size = static_cast<std::uint32_t>(columns);
  array.layout.dim[0].stride = static_cast<std::uint32_t>(rows * columns);
  array.layout.dim[1].label = "row_index";
  array.layout.dim[1].size = static_cast<std::uint32_t>(rows);
  array.layout.dim[1].stride = static_cast<std::uint32_t>(rows);
  array.data = values;
  return array;
}

} // namespace

Header
toHeader(const std_msgs::Header& header)
{
  return {static_cast<Stamp>(header.stamp.toNSec()), header.frame_id};
}

std_msgs::Header
toMessage(const Header& header)
{
  std_msgs::Header message;
  message.stamp.fromNSec(static_cast<std::uint64_t>(header.stamp));
  message.frame_id = header.frame_id;
  return message;
}

geometry_msgs::Point
toPoint(const Eigen::Vector3d& point)
{
  geometry_msgs::Point message;
  message.x = point.x();
  message.y = point.y();
  message.z = point.z();
  return message;
}

geometry_msgs::Quaternion
toQuaternion(const Eigen::Matrix3d& rotation)
{
  const Eigen::Quaterniond q(rotation);
  geometry_msgs::Quaternion message;
  message.x = q.x();
  message.y = q.y();
  message.z = q.z();
  message.w = q.w();
  return message;
}

geometry_msgs::Pose
toMessage(const Pose& pose)
{
  geometry_msgs::Pose message;
  message.position = toPoint(pose.c);
  message.orientation = toQuaternion(pose.R);
  return message;
}

geometry_msgs::Transform
toTransform(const Pose& pose)
{
  geometry_msgs::Transform message;
  message.translation.x = pose.c.x();
  message.translation.y = pose.c.y();
  message.translation.z = pose.c.z();
  message.rotation = toQuaternion(pose.R);
  return message;
}

Pose
toPose(const geometry_msgs::Transform& transform)
{
  const auto& q = transform.rotation;
  const auto& t = transform.translation;
  return {Eigen::Quaterniond(q.w, q.x, q.y, q.z).normalized().toRotationMatrix(),
          {t.x, t.y, t.z}};
}

RangeCloud
toRangeCloud(const sensor_msgs::PointCloud2& message)
{
  PointLayout layout;
  layout.width = message.width;
  layout.height = message.height;
  layout.point_step = message.point_step;
  layout.row_step = message.row_step;
  layout.x = offsetOf(message, "x");
  layout.y = offsetOf(message, "y");
  layout.z = offsetOf(message, "z");
  layout.is_bigendian = message.is_bigendian != 0;
  return readPoints(layout, message.data.data(), message.data.size());
}

RangeCloud
toRangeCloud(const sensor_msgs::Image& message, const Sensor& sensor)
{
  DepthLayout layout;
  layout.width = message.width;
  layout.height = message.height;
  layout.row_step = message.step;
  layout.encoding = message.encoding;
  layout.is_bigendian = message.is_bigendian != 0;
  return readDepth(layout, message.data.data(), message.data.size(), sensor);
}

Camera
toCamera(const sensor_msgs::CameraInfo& info)
{
  Camera camera;
  camera.width = static_cast<int>(info.width);
  camera.height = static_cast<int>(info.height);
  // K is that of the image before it was rectified; drivers may leave P empty.
  const bool has_p = info.P[0] > 0.0;
  camera.fx = has_p ? info.P[0] : info.K[0];
  camera.fy = has_p ? info.P[5] : info.K[4];
  camera.cx = has_p ? info.P[2] : info.K[2];
  camera.cy = has_p ? info.P[6] : info.K[5];
  return camera;
}

VelocityError
toVelocityError(const nav_msgs::Odometry& message)
{
  // Of (linear, angular), row by row.
  const Eigen::Map<const Eigen::Matrix<double, 6, 6, Eigen::RowMajor>> covariance(
      message.twist.covariance.data());
  JetMatrix swap = JetMatrix::Zero();
  swap.topRightCorner<3, 3>().setIdentity();
  swap.bottomLeftCorner<3, 3>().setIdentity();
  return {swap * covariance * swap.transpose(), message.child_frame_id};
}

holdfast_msgs::PatchArray
toPatchArray(const Answer& answer)
{
  holdfast_msgs::PatchArray message;
  message.header = toMessage(answer.header);
  for (const AnswerPatch& patch : answer.patches)
    message.patches.push_back(patchMessage(patch));
  for (const Complaint& complaint : answer.complaints)
    message.problem += (message.problem.empty() ? "" : "; ") + complaint.text;
  message.notices = answer.notices;
  message.failed_seeds = static_cast<std::uint32_t>(answer.failed_seeds);
  message.turned_down = static_cast<std::uint32_t>(answer.turned_down);
  message.work_ms = static_cast<float>(answer.work_ms);
  return message;
}

holdfast_msgs::FootholdArray
toFootholds(const Answer& answer, const std::string& foot)
{
  const FootholdRanking& ranking = answer.risk->ranking;
  holdfast_msgs::FootholdArray message;
  message.header = toMessage(answer.header);
  message.foot = foot;
  message.load_direction.x = answer.risk->load_direction.x();
  message.load_direction.y = answer.risk->load_direction.y();
  message.load_direction.z = answer.risk->load_direction.z();
  for (const Foothold& foothold : ranking.footholds) {
    message.footholds.push_back(footholdMessage(foothold));
    message.footholds.back().patch = answer.is_map ? foothold.patch : 0;
  }
  message.candidates = static_cast<std::uint32_t>(ranking.candidates);
  message.without_support = static_cast<std::uint32_t>(ranking.without_support);
  message.not_facing = static_cast<std::uint32_t>(ranking.not_facing);
  message.unseen = static_cast<std::uint32_t>(ranking.unseen);
  message.too_near = static_cast<std::uint32_t>(ranking.too_near);
  message.beyond_limit = static_cast<std::uint32_t>(ranking.beyond_limit);
  return message;
}

grid_map_msgs::GridMap
toGridMap(const RiskGrid& grid, const std_msgs::Header& header)
{
  grid_map_msgs::GridMap message;
  message.info.header = header;
  message.info.resolution = grid.info.resolution_m;
  message.info.length_x = grid.info.length_x_m;
  message.info.length_y = grid.info.length_y_m;
  message.info.pose = toMessage(Pose{Eigen::Matrix3d::Identity(), grid.info.position});
  message.layers = grid.layers;
  message.basic_layers = grid.basic_layers;
  for (const std::vector<float>& values : grid.data)
    message.data.push_back(toArray(values, grid.rows, grid.columns));
  message.outer_start_index = grid.outer_start_index;
  message.inner_start_index = grid.inner_start_index;
  return message;
}

} // namespace holdfast::robot
