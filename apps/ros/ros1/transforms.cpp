#include "ros1/transforms.h"

#include "ros1/conversions.h"

#include <thread>

namespace holdfast::robot {

Transforms::Transforms(std::chrono::duration<double> timeout)
: timeout_(timeout), listener_(buffer_)
{}

std::optional<Pose>
Transforms::find(const std::string& target,
                 const std::string& source,
                 Stamp stamp,
                 std::string& cause) const
{
  ros::Time time;
  time.fromNSec(static_cast<std::uint64_t>(stamp));
  // By the wall's clock: that of a bag may stand still.
  using Clock = std::chrono::steady_clock;
  const auto end = Clock::now() + timeout_;
  cause.clear();
  while (!buffer_.canTransform(target, source, time, &cause)) {
    if (Clock::now() >= end || is_stopped_)
      return std::nullopt;
    cause.clear();
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  try {
    return toPose(buffer_.lookupTransform(target, source, time).transform);
  }
  catch (const tf2::TransformException& error) { // gone in between
    cause = error.what();
    return std::nullopt;
  }
}

void
Transforms::clear()
{
  buffer_.clear();
}

void
Transforms::tell(const Header& header, const std::string& child, const Pose& pose)
{
  geometry_msgs::TransformStamped message;
  message.header = toMessage(header);
  message.child_frame_id = child;
  message.transform = toTransform(pose);
  broadcaster_.sendTransform(message);
}

} // namespace holdfast::robot
