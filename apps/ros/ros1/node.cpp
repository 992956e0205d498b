#include "ros1/node.h"

#include "ros1/conversions.h"
#include "ros1/markers.h"

#include <fmt/format.h>

#include <algorithm>
#include <exception>

namespace holdfast::robot {
namespace {

/// What roscpp keeps until it is read: all, since frames are dropped by our own queue,
/// which counts.
constexpr std::uint32_t kUnread = 1000;
constexpr std::uint32_t kUnsent = 100;
constexpr const char* kGridFrame = "holdfast_grid";

} // namespace

Node::Node()
: own_("~")
, parameters_(readParameters(own_))
, transforms_(parameters_.transform_timeout)
, session_(parameters_.settings,
           Tuning(),
           [this](const std::string& target,
                  const std::string& source,
                  Stamp stamp,
                  std::string& cause) {
             return transforms_.find(target, source, stamp, cause);
           })
, throttle_(std::chrono::duration_cast<TroubleThrottle::Clock::duration>(
      parameters_.warning_period))
, queue_(static_cast<std::size_t>(parameters_.queue))
, server_(own_)
{
  patches_ = own_.advertise<holdfast_msgs::PatchArray>("patches", kUnsent);
  markers_ = own_.advertise<visualization_msgs::MarkerArray>("markers", 1);
  if (!parameters_.settings.foot.empty()) {
    grid_ = own_.advertise<grid_map_msgs::GridMap>("grid", 1);
    footholds_ = own_.advertise<holdfast_msgs::FootholdArray>("footholds", kUnsent);
  }
  server_.setCallback([this](const ::holdfast::HoldfastConfig& config, std::uint32_t) {
    session_.tune(toTuning(config));
  });
  updater_.setHardwareID(session_.sensor().name);
  updater_.add("patches", [this](auto& status) { diagnose(status); });
  timer_ = public_.createWallTimer(ros::WallDuration(1.0),
                                   [this](const auto&) { updater_.force_update(); });
  worker_ = std::thread([this] { work(); });
  subscribe();
}

Node::~Node()
{
  queue_.close();
  transforms_.stop();
  worker_.join();
}

void
Node::subscribe()
{
  if (parameters_.input == Input::Cloud) {
    frames_ = public_.subscribe<sensor_msgs::PointCloud2>(
        "cloud",
        kUnread,
        [this](const sensor_msgs::PointCloud2ConstPtr& message) {
          queue_.put({message, nullptr, std::nullopt, Clock::now()});
        });
  }
  else {
    camera_info_ = public_.subscribe<sensor_msgs::CameraInfo>(
        "depth/camera_info",
        kUnread,
        [this](const sensor_msgs::CameraInfoConstPtr& message) {
          camera_ = toCamera(*message);
        });
    frames_ = public_.subscribe<sensor_msgs::Image>(
        "depth/image",
        kUnread,
        [this](const sensor_msgs::ImageConstPtr& message) {
          queue_.put({nullptr, message, camera_, Clock::now()});
        });
  }
  if (parameters_.settings.map && !parameters_.settings.odometry_frame.empty())
    odometry_ = public_.subscribe<nav_msgs::Odometry>(
        "odometry",
        kUnread,
        [this](const nav_msgs::OdometryConstPtr& message) {
          session_.hear(toVelocityError(*message));
        });
}

Tuning
Node::toTuning(const ::holdfast::HoldfastConfig& config)
{
  Tuning tuning;
  tuning.radius_m = config.radius;
  tuning.max_patches = config.max_patches;
  tuning.budget_ms = config.budget_ms;
  tuning.max_chi2_per_dof = config.max_chi2_per_dof;
  tuning.min_coverage = config.min_coverage;
  tuning.max_view_angle_deg = config.max_view_angle;
  tuning.max_curvature_per_m = config.max_curvature;
  return tuning;
}

Frame
Node::toFrame(const Received& received) const
{
  Frame frame;
  frame.header =
      toHeader(received.cloud ? received.cloud->header : received.depth->header);
  try {
    if (received.cloud) {
      frame.cloud = toRangeCloud(*received.cloud);
    }
    else if (received.camera) {
      frame.camera = received.camera;
      frame.cloud = toRangeCloud(*received.depth,
                                 withCamera(session_.sensor(), *received.camera));
    }
    else {
      frame.unreadable = "a depth image came before any camera_info";
    }
  }
  catch (const std::exception& error) {
    frame.unreadable = error.what();
  }
  return frame;
}

void
Node::work()
{
  while (const std::optional<Received> received = queue_.take()) {
    const Answer answer = session_.answer(toFrame(*received));
    if (transforms_.isStopped())
      return; // what was waited for was given up
    if (answer.time_jumped)
      transforms_.clear();
    say(answer);
    publish(answer, received->time);
  }
}

void
Node::say(const Answer& answer)
{
  for (const Complaint& complaint : answer.complaints)
    if (const auto line = throttle_.pass(complaint.trouble, complaint.text))
      ROS_WARN("%s", line->c_str());
  if (!answer.notices.empty())
    ROS_INFO_THROTTLE(parameters_.warning_period.count(),
                      "%s",
                      fmt::format("{}", fmt::join(answer.notices, "; ")).c_str());
}

void
Node::publish(const Answer& answer, Clock::time_point received)
{
  if (answer.map_in_cloud)
    transforms_.tell(answer.cloud, answer.header.frame_id, *answer.map_in_cloud);
  if (answer.risk)
    publishRisk(answer);
  if (markers_.getNumSubscribers() > 0)
    markers_.publish(toMarkers(answer, parameters_.markers));
  holdfast_msgs::PatchArray message = toPatchArray(answer);
  message.sensor = session_.sensor().name;
  message.frames_dropped = static_cast<std::uint32_t>(queue_.dropped());
  const double latency_ms =
      std::chrono::duration<double, std::milli>(Clock::now() - received).count();
  message.latency_ms = static_cast<float>(latency_ms);
  patches_.publish(message);
  const std::lock_guard<std::mutex> lock(mutex_);
  ++totals_.answered;
  totals_.failed += answer.complaints.empty() ? 0 : 1;
  totals_.patches = answer.patches.size();
  totals_.latency_ms = latency_ms;
  totals_.worst_latency_ms = std::max(totals_.worst_latency_ms, latency_ms);
  totals_.problem = message.problem;
}

/// grid_map takes the axes of the frame for those of the grid: where they differ, the
/// grid has a frame of its own.
void
Node::publishRisk(const Answer& answer)
{
  const RiskGrid& grid = answer.risk->grid;
  std_msgs::Header header = toMessage(answer.header);
  if (!grid.info.axes.isIdentity()) {
    transforms_.tell(answer.header,
                     kGridFrame,
                     {grid.info.axes, Eigen::Vector3d::Zero()});
    header.frame_id = kGridFrame;
  }
  grid_.publish(toGridMap(grid, header));
  footholds_.publish(toFootholds(answer, session_.footName()));
}

void
Node::diagnose(diagnostic_updater::DiagnosticStatusWrapper& status)
{
  using Status = diagnostic_msgs::DiagnosticStatus;
  const std::lock_guard<std::mutex> lock(mutex_);
  if (totals_.answered == 0)
    status.summary(Status::WARN, "no frame yet");
  else if (!totals_.problem.empty())
    status.summary(Status::WARN, totals_.problem);
  else
    status.summaryf(Status::OK, "%zu patches", totals_.patches);
  status.add("frames received", queue_.received());
  status.add("frames dropped for newer ones", queue_.dropped());
  status.add("frames answered", totals_.answered);
  status.add("frames with a problem", totals_.failed);
  status.add("latency of the last frame, ms", totals_.latency_ms);
  status.add("largest latency, ms", totals_.worst_latency_ms);
}

} // namespace holdfast::robot
