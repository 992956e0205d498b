// From a cloud to patches in a few lines: prints every patch of a PCD file, its normal
// and how sure its height along that normal is.
//
//   first_patch samples/rocks.pcd
#include <holdfast/io/cloud_io.h>
#include <holdfast/io/config.h>
#include <holdfast/pcl/patch_extraction.h>

#include <cmath>
#include <exception>
#include <iostream>
#include <string>

// [snippet]
void
printPatches(const std::string& path)
{
  const holdfast::Sensor sensor = holdfast::loadSensor("kinect_v1");
  const holdfast::RangeCloud cloud = holdfast::loadCloud(path);
  const auto result = holdfast::extractPatches(cloud, sensor, {});
  for (const holdfast::ExtractedPatch& found : result.patches) {
    const Eigen::Vector3d n = found.fit.patch.normal();
    // The covariance is that of [d | k | r | c]: the centre c comes last.
    const Eigen::Matrix3d centre = found.fit.covariance.bottomRightCorner<3, 3>();
    std::cout << holdfast::surfaceName(found.fit.patch.type.surface) << "  normal "
              << n.transpose() << "  sigma " << std::sqrt(n.dot(centre * n)) << " m\n";
  }
}
// [end]

int
main(int argc, char** argv)
{
  if (argc != 2) {
    std::cerr << "usage: first_patch CLOUD\n";
    return 2;
  }
  try {
    printPatches(argv[1]);
  }
  catch (const std::exception& error) {
    std::cerr << "first_patch: " << error.what() << '\n';
    return 1;
  }
  return 0;
}
