// Uses holdfast::clouds: a cloud to a file and back, and one patch to all of it.
#include <holdfast/io/cloud_io.h>
#include <holdfast/pcl/patch_extraction.h>
#include <holdfast/sensor/constant_noise_model.h>

#include <cstdio>
#include <memory>

int
main()
{
  auto points = std::make_shared<pcl::PointCloud<pcl::PointXYZ>>();
  for (int i = 0; i < 400; ++i) {
    const float x = 0.01F * static_cast<float>(i % 20), y = 0.01F * (i / 20);
    points->push_back(pcl::PointXYZ(x, y, 1.0F + x * x + y * y));
  }
  holdfast::RangeCloud cloud;
  cloud.points = points;
  holdfast::saveCloud("clouds_consumer.pcd", cloud);

  holdfast::Sensor sensor;
  sensor.noise = std::make_shared<holdfast::ConstantNoiseModel>(
      holdfast::ConstantNoiseModel::Parameters());
  const auto result =
      holdfast::extractWhole(holdfast::loadCloud("clouds_consumer.pcd"), sensor, {});
  std::printf("%zu patch\n", result.patches.size());
  return result.patches.size() != 1;
}
