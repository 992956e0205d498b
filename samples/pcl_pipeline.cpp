// Patches at the end of a PCL pipeline: cut the cloud, choose seeds, fit, and write the
// patches as a cloud of points with normals.
//
//   pcl_pipeline samples/rocks.pcd patches.pcd
//   pcl_viewer samples/rocks.pcd patches.pcd -normals 1 -ps 5
#include <holdfast/io/config.h>
#include <holdfast/pcl/patch_estimation.h>

#include <pcl/common/point_tests.h>
#include <pcl/filters/passthrough.h>
#include <pcl/io/pcd_io.h>

#include <exception>
#include <iostream>
#include <string>

using Cloud = pcl::PointCloud<pcl::PointXYZ>;
using Patches = pcl::PointCloud<holdfast::PatchPoint>;

namespace {

// What lies up to 1.5 m before a robot's camera or, in a world frame, above the ground.
Cloud::Ptr
within(const Cloud::ConstPtr& cloud, float low, float high)
{
  pcl::PassThrough<pcl::PointXYZ> pass;
  pass.setInputCloud(cloud);
  pass.setFilterFieldName("z");
  pass.setFilterLimits(low, high);
  // Points that are cut become NaN, and neighbourhoods still follow the pixels.
  pass.setKeepOrganized(true);
  auto cut = pcl::make_shared<Cloud>();
  pass.filter(*cut);
  return cut;
}

Patches
patchesOf(const Cloud::ConstPtr& cloud)
{
  // Twenty seeds at random, no two closer than 10 cm.
  holdfast::SamplerOptions sampler;
  sampler.strategy = holdfast::SeedStrategy::Poisson;
  sampler.spacing_m = 0.1;
  sampler.max_seeds = 20;

  holdfast::PatchEstimation<pcl::PointXYZ> estimation;
  estimation.setInputCloud(cloud);
  estimation.setSensor(holdfast::loadSensor("kinect_v1"));
  estimation.setSamplerOptions(sampler);
  estimation.setSeedsFromSampler(true);
  estimation.setRadiusSearch(0.05);
  Patches attempts;
  estimation.compute(attempts);

  // Seeds without a patch are NaN, as in any feature.
  Patches patches = attempts;
  patches.clear();
  for (const holdfast::PatchPoint& point : attempts)
    if (pcl::isFinite(point))
      patches.push_back(point);
  patches.is_dense = true;
  return patches;
}

int
run(const std::string& input, const std::string& output)
{
  auto cloud = pcl::make_shared<Cloud>();
  if (pcl::io::loadPCDFile(input, *cloud) != 0)
    return 1;
  const Patches patches = patchesOf(within(cloud, 0.05F, 1.5F));
  std::cout << patches.size() << " patches\n";
  return pcl::PCDWriter().writeBinaryCompressed(output, patches) == 0 ? 0 : 1;
}

} // namespace

int
main(int argc, char** argv)
{
  try {
    if (argc == 3)
      return run(argv[1], argv[2]);
    std::cerr << "usage: pcl_pipeline CLOUD.pcd PATCHES.pcd\n";
    return 2;
  }
  catch (const std::exception& error) {
    std::cerr << "pcl_pipeline: " << error.what() << '\n';
    return 1;
  }
}
