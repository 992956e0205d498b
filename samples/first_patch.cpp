// From a cloud to patches in a few lines: prints every patch of a PCD file, its normal,
// how sure that and the height along it are, and how well the points fit.
//
//   first_patch samples/rocks.pcd
#include <holdfast/io/cloud_io.h>
#include <holdfast/io/config.h>
#include <holdfast/pcl/patch_extraction.h>

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
    std::cout << holdfast::surfaceName(found.fit.patch.type.surface) << "  normal "
              << n.transpose() << " sigma " << holdfast::normalSigma(found.fit)
              << " rad, height sigma " << holdfast::centreSigma(found.fit, n)
              << " m, chi2/dof " << holdfast::chi2PerDof(found.fit) << '\n';
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
