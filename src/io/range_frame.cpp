#include <holdfast/io/range_frame.h>
#include <holdfast/pcl/conversions.h>
#include <holdfast/pcl/intrinsics.h>

#include <stdexcept>
#include <type_traits>

namespace holdfast {

namespace {

using Use = std::function<void(const RangeFrame::ConstPtr&)>;

/// Plain clouds, as PCL's grabbers deliver them.
template <typename PointT>
boost::signals2::connection
connectClouds(pcl::Grabber& grabber, const Use& use)
{
  using CloudConstPtr = typename pcl::PointCloud<PointT>::ConstPtr;
  const auto convert = [use](const CloudConstPtr& cloud) {
    auto frame = std::make_shared<RangeFrame>();
    frame->received = std::chrono::steady_clock::now();
    frame->cloud = toRangeCloud<PointT>(cloud);
    frame->camera = recoverIntrinsics(frame->cloud).value_or(Camera{});
    frame->timestamp_us = cloud->header.stamp;
    frame->index = static_cast<int>(cloud->header.seq);
    if constexpr (std::is_same_v<PointT, pcl::PointXYZRGBA>)
      frame->colored = cloud;
    use(frame);
  };
  return grabber.registerCallback(std::function<void(const CloudConstPtr&)>(convert));
}

/// Connects nothing unless the grabber provides such clouds.
template <typename PointT>
bool
tryClouds(pcl::Grabber& grabber, const Use& use, boost::signals2::connection& to)
{
  if (!grabber
           .providesCallback<void(const typename pcl::PointCloud<PointT>::ConstPtr&)>())
    return false;
  to = connectClouds<PointT>(grabber, use);
  return true;
}

} // namespace

boost::signals2::connection
connectFrames(pcl::Grabber& grabber, const Use& use)
{
  if (grabber.providesCallback<void(const RangeFrame::ConstPtr&)>())
    return grabber.registerCallback(use);
  boost::signals2::connection connection;
  if (tryClouds<pcl::PointXYZRGBA>(grabber, use, connection) ||
      tryClouds<pcl::PointXYZRGB>(grabber, use, connection) ||
      tryClouds<pcl::PointXYZI>(grabber, use, connection) ||
      tryClouds<pcl::PointXYZ>(grabber, use, connection))
    return connection;
  throw std::invalid_argument(grabber.getName() + " delivers no clouds");
}

} // namespace holdfast
