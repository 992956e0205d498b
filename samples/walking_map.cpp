// A map of patches while a robot walks: frames and odometry in, one fused cloud out.
//
//   holdfast simulate boulder_field --trajectory walk --frames 20 -o walk
//   walking_map walk/trajectory.txt patches.pcd walk/frame_*.pcd
#include <holdfast/io/config.h>
#include <holdfast/io/trajectory_file.h>
#include <holdfast/pcl/map_conversions.h>
#include <holdfast/pcl/patch_estimation.h>

#include <pcl/io/pcd_io.h>

#include <exception>
#include <iostream>

static int
run(const std::string& trajectory, const std::string& output, char** frames, int count)
{
  const auto poses = holdfast::readTrajectory(trajectory);
  if (poses.size() < static_cast<std::size_t>(count))
    throw std::runtime_error(trajectory + ": fewer poses than frames");
  holdfast::FitOptions fit; // what is fused must not depend on a choice of type
  fit.surface = holdfast::SurfaceRequest::Paraboloid;
  holdfast::PatchEstimation<pcl::PointXYZ> estimation;
  estimation.setSensor(holdfast::loadSensor("kinect_v1"));
  estimation.setFitOptions(fit);
  estimation.setSeedsFromSampler(true);
  estimation.setRadiusSearch(0.05);
  holdfast::PatchMap map;
  // The legs' odometry from frame to frame: 1 mrad and 1 mm along each axis.
  const holdfast::JetMatrix odometry = 1e-6 * holdfast::JetMatrix::Identity();
  for (int i = 0; i < count; ++i) {
    auto cloud = pcl::make_shared<pcl::PointCloud<pcl::PointXYZ>>();
    if (pcl::io::loadPCDFile(frames[i], *cloud) != 0)
      return 1;
    pcl::PointCloud<holdfast::PatchPoint> patches;
    estimation.setInputCloud(cloud);
    estimation.compute(patches);
    const holdfast::Pose step = poses[i > 0 ? i - 1 : 0].pose.inverse() * poses[i].pose;
    const auto report = holdfast::updateMap(map, patches, step, odometry);
    std::cout << frames[i] << ": " << report.fused << " fused, " << report.born
              << " born, " << map.patches().size() << " in the map\n";
  }
  return pcl::io::savePCDFileBinary(output, holdfast::toPatchCloud(map)) == 0 ? 0 : 1;
}

int
main(int argc, char** argv)
{
  try {
    if (argc > 3)
      return run(argv[1], argv[2], argv + 3, argc - 3);
    std::cerr << "usage: walking_map TRAJECTORY.txt PATCHES.pcd FRAME.pcd...\n";
    return 2;
  }
  catch (const std::exception& error) {
    std::cerr << "walking_map: " << error.what() << '\n';
    return 1;
  }
}
