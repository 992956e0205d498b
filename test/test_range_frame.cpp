// Frames from grabbers that are not ours.
#include "support/organized_cloud.h"

#include <holdfast/io/range_frame.h>

#include <pcl/common/io.h>

#include <gtest/gtest.h>

#include <stdexcept>
#include <type_traits>

namespace holdfast { namespace {

using test::makeCamera;
using test::makeOrganizedCloud;

/// Delivers clouds of one type of point when it is told to.
template <typename PointT>
class OneTypeGrabber : public pcl::Grabber {
public:
  using CloudConstPtr = typename pcl::PointCloud<PointT>::ConstPtr;

  OneTypeGrabber() : signal_(createSignal<void(const CloudConstPtr&)>()) {}
  void start() override {}
  void stop() override {}
  bool isRunning() const override
  {
    return true;
  }
  std::string getName() const override
  {
    return "OneTypeGrabber";
  }
  float getFramesPerSecond() const override
  {
    return 0.0F;
  }
  void deliver(const CloudConstPtr& cloud)
  {
    (*signal_)(cloud);
  }

private:
  boost::signals2::signal<void(const CloudConstPtr&)>* signal_;
};

const Camera kCamera = makeCamera(80, 60, 90.0);

RangeCloud
makeSlope()
{
  return makeOrganizedCloud(kCamera, [](int u, int v) {
    return u == 3 && v == 3 ? std::nan("") : 1.0 + 0.002 * u + 0.001 * v;
  });
}

template <typename T>
class FramesOf : public testing::Test {};

using PointTypes =
    testing::Types<pcl::PointXYZ, pcl::PointXYZI, pcl::PointXYZRGB, pcl::PointXYZRGBA>;
TYPED_TEST_SUITE(FramesOf, PointTypes);

TYPED_TEST(FramesOf, PclGrabbers)
{
  const RangeCloud slope = makeSlope();
  auto cloud = pcl::make_shared<pcl::PointCloud<TypeParam>>();
  pcl::copyPointCloud(*slope.points, *cloud);
  cloud->header.stamp = 33333;
  cloud->header.seq = 7;
  OneTypeGrabber<TypeParam> grabber;
  RangeFrame::ConstPtr frame;
  const boost::signals2::scoped_connection connection =
      connectFrames(grabber,
                    [&frame](const RangeFrame::ConstPtr& newest) { frame = newest; });
  grabber.deliver(cloud);
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->timestamp_us, 33333U);
  EXPECT_EQ(frame->index, 7);
  EXPECT_EQ(frame->cloud.points->width, 80U);
  EXPECT_EQ(frame->cloud.points->height, 60U);
  EXPECT_EQ((*frame->cloud.points)(50, 40).z, (*slope.points)(50, 40).z);
  // From single precision, over 80 pixels.
  EXPECT_NEAR(frame->camera.fx, kCamera.fx, 1e-2);
  EXPECT_NEAR(frame->camera.cy, kCamera.cy, 1e-2);
  EXPECT_EQ(frame->colored != nullptr, (std::is_same_v<TypeParam, pcl::PointXYZRGBA>));
}

TEST(Frames, OfAGrabberWithoutCloudsAreMisuse)
{
  OneTypeGrabber<pcl::PointNormal> grabber;
  EXPECT_THROW(connectFrames(grabber, [](const RangeFrame::ConstPtr&) {}),
               std::invalid_argument);
}

}} // namespace holdfast
