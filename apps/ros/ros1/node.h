/// \file The node for ROS 1: topics in and out of a session.
#pragma once

#include "core/frame_queue.h"
#include "core/session.h"
#include "ros1/parameters.h"
#include "ros1/transforms.h"

#include <holdfast/HoldfastConfig.h>

#include <diagnostic_updater/diagnostic_updater.h>
#include <dynamic_reconfigure/server.h>
#include <nav_msgs/Odometry.h>
#include <ros/ros.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>
#include <sensor_msgs/PointCloud2.h>

#include <chrono>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

namespace holdfast::robot {

class Node {
public:
  /// \throw std::runtime_error or std::invalid_argument when a parameter is wrong.
  Node();
  ~Node();
  Node(const Node&) = delete;
  Node& operator=(const Node&) = delete;

private:
  using Clock = std::chrono::steady_clock;

  /// One of the messages, and what goes with it.
  struct Received {
    sensor_msgs::PointCloud2ConstPtr cloud;
    sensor_msgs::ImageConstPtr depth;
    std::optional<Camera> camera; ///< of the depth image; nothing: not known yet
    Clock::time_point time;
  };

  struct Totals {
    std::uint64_t answered = 0;
    std::uint64_t failed = 0; ///< of those, the ones with a complaint
    std::size_t patches = 0; ///< of the last answer
    double latency_ms = 0.0; ///< the same
    double worst_latency_ms = 0.0;
    std::string problem; ///< the same as patches
  };

  void subscribe();
  Frame toFrame(const Received& received) const;
  void work();
  void say(const Answer& answer);
  void publish(const Answer& answer, Clock::time_point received);
  void publishRisk(const Answer& answer);
  void diagnose(diagnostic_updater::DiagnosticStatusWrapper& status);
  static Tuning toTuning(const ::holdfast::HoldfastConfig& config);

  ros::NodeHandle public_;
  ros::NodeHandle own_;
  NodeParameters parameters_;
  Transforms transforms_;
  Session session_;
  TroubleThrottle throttle_;
  FrameQueue<Received> queue_;
  std::optional<Camera> camera_; ///< last camera_info; of the thread that receives

  mutable std::mutex mutex_;
  Totals totals_;

  ros::Publisher patches_, markers_, grid_, footholds_;
  ros::Subscriber frames_, camera_info_, odometry_;
  dynamic_reconfigure::Server<::holdfast::HoldfastConfig> server_;
  diagnostic_updater::Updater updater_;
  ros::WallTimer timer_;
  std::thread worker_;
};

} // namespace holdfast::robot
