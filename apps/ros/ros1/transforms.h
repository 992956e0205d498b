/// \file Poses from tf.
#pragma once

#include "core/session.h"

#include <tf2_ros/buffer.h>
#include <tf2_ros/transform_broadcaster.h>
#include <tf2_ros/transform_listener.h>

#include <atomic>
#include <chrono>
#include <string>

namespace holdfast::robot {

/// Listens to tf, and tells it what this node alone knows.
class Transforms {
public:
  /// \param timeout how long find() waits for what has not come yet.
  explicit Transforms(std::chrono::duration<double> timeout);

  /// A TransformLookup.
  std::optional<Pose> find(const std::string& target,
                           const std::string& source,
                           Stamp stamp,
                           std::string& cause) const;

  /// Ends all waiting, for good; from any thread.
  void stop()
  {
    is_stopped_ = true;
  }
  bool isStopped() const
  {
    return is_stopped_;
  }

  /// Forgets what came before a time jump.
  void clear();

  /// \param pose of frame `child` in the frame of the header.
  void tell(const Header& header, const std::string& child, const Pose& pose);

private:
  std::chrono::duration<double> timeout_;
  std::atomic<bool> is_stopped_{false};
  tf2_ros::Buffer buffer_;
  tf2_ros::TransformListener listener_;
  tf2_ros::TransformBroadcaster broadcaster_;
};

} // namespace holdfast::robot
