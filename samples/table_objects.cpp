// Cans, mugs, balls and bowls on a table: finds the plane, takes what stands on it
// apart, and tells of every object that is round how large it is and how sure that is.
//
//   holdfast simulate table -o table.pcd
//   table_objects table.pcd
#include <holdfast/io/config.h>
#include <holdfast/pcl/patch_segmentation.h>

#include <pcl/io/pcd_io.h>
#include <pcl/search/kdtree.h>
#include <pcl/segmentation/extract_clusters.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <iostream>
#include <iterator>
#include <string>
#include <vector>

using Cloud = pcl::PointCloud<pcl::PointXYZ>;
using Segmentation = holdfast::PatchSegmentation<pcl::PointXYZ>;

namespace {

// Farther away a Kinect is too coarse to tell small radii.
pcl::IndicesPtr
withinReach(const Cloud& cloud)
{
  constexpr float kReach = 1.6F; // m
  auto near = pcl::make_shared<pcl::Indices>();
  for (int i = 0; i < static_cast<int>(cloud.size()); ++i)
    if ((cloud[i].getVector4fMap() - cloud.sensor_origin_).head<3>().norm() < kReach)
      near->push_back(i);
  return near;
}

// The largest surface of one kind, as a patch of the points on it.
holdfast::FitResult
largest(Segmentation& segmentation, pcl::SacModel kind, pcl::PointIndices& inliers)
{
  pcl::ModelCoefficients coefficients;
  segmentation.setModelType(kind);
  segmentation.segment(inliers, coefficients);
  return segmentation.getPatch();
}

// What is between 1 and 40 cm above the table, in pieces that are 8 mm apart.
std::vector<pcl::PointIndices>
objectsOn(const holdfast::Patch& table,
          const Cloud::ConstPtr& cloud,
          const pcl::Indices& near)
{
  const auto above = pcl::make_shared<pcl::Indices>();
  for (const int i : near) {
    const Eigen::Vector3d q = (*cloud)[i].getVector3fMap().cast<double>();
    // The normal of a patch points to the sensor's side.
    const double height = table.pose().toLocal(q).z();
    if (height > 0.01 && height < 0.4)
      above->push_back(i);
  }
  pcl::EuclideanClusterExtraction<pcl::PointXYZ> clustering;
  clustering.setInputCloud(cloud);
  clustering.setIndices(above);
  clustering.setSearchMethod(pcl::make_shared<pcl::search::KdTree<pcl::PointXYZ>>());
  clustering.setClusterTolerance(0.008);
  clustering.setMinClusterSize(500);
  std::vector<pcl::PointIndices> objects;
  clustering.extract(objects);
  return objects;
}

// The surface that most points are on. A more complicated one has to gain 5 %. Within
// two sigmas, the noise of a surface has a variance of 0.77, and points that just
// happen to be there of 4/3.
holdfast::FitResult
largestOfAll(Segmentation& segmentation, pcl::Indices& inliers)
{
  holdfast::FitResult best;
  for (const auto kind :
       {pcl::SACMODEL_PLANE, pcl::SACMODEL_SPHERE, pcl::SACMODEL_CYLINDER}) {
    pcl::PointIndices on_surface;
    const holdfast::FitResult fit = largest(segmentation, kind, on_surface);
    if (holdfast::isUsable(fit.status) && fit.chi2 < 0.9 * fit.chi2_dof &&
        fit.points > 1.05 * best.points) {
      best = fit;
      inliers = on_surface.indices;
    }
  }
  return best;
}

void
print(const holdfast::FitResult& fit)
{
  std::cout << "  " << holdfast::surfaceName(fit.patch.type.surface);
  if (fit.patch.type.surface != holdfast::SurfaceType::Plane) {
    // The parameters are [d | k | r | c]; R = 1/|kappa|, so sigma_R = R^2 sigma_kappa.
    const int k = holdfast::boundaryParameterCount(fit.patch.type.boundary);
    const double radius = 1.0 / std::abs(fit.patch.kappa[0]);
    const double sigma = radius * radius * std::sqrt(fit.covariance(k, k));
    std::cout << (fit.patch.kappa[0] > 0.0 ? " inside" : " outside") << " radius "
              << 1e3 * radius << " sigma " << 1e3 * sigma << " mm";
  }
  std::cout << " points " << fit.points << " at " << fit.patch.c.transpose() << '\n';
}

// Surface by surface, the largest first, while they are a quarter of the object.
void
takeApart(Segmentation& segmentation, pcl::Indices object)
{
  const auto enough = static_cast<int>(object.size()) / 4;
  for (;;) {
    segmentation.setIndices(pcl::make_shared<pcl::Indices>(object));
    pcl::Indices inliers;
    const holdfast::FitResult fit = largestOfAll(segmentation, inliers);
    if (fit.points < enough)
      return;
    print(fit);
    std::sort(inliers.begin(), inliers.end());
    pcl::Indices rest;
    std::set_difference(object.begin(),
                        object.end(),
                        inliers.begin(),
                        inliers.end(),
                        std::back_inserter(rest));
    object = rest;
  }
}

int
run(const std::string& path)
{
  const auto cloud = pcl::make_shared<Cloud>();
  if (pcl::io::loadPCDFile(path, *cloud) != 0)
    return 1;
  Segmentation segmentation;
  segmentation.setInputCloud(cloud);
  segmentation.setSensor(holdfast::loadSensor("kinect_v1"));
  segmentation.setMethodType(pcl::SAC_RANSAC);
  segmentation.setSigmaThreshold(2.0); // of each point's own noise
  segmentation.setRadiusLimits(0.02, 0.12);
  segmentation.setMaxIterations(5000);
  segmentation.setProbability(0.9999);

  const auto near = withinReach(*cloud);
  segmentation.setIndices(near);
  pcl::PointIndices on_table;
  const auto table = largest(segmentation, pcl::SACMODEL_PLANE, on_table);
  if (!holdfast::isUsable(table.status))
    return 1;
  for (pcl::PointIndices& object : objectsOn(table.patch, cloud, *near)) {
    std::sort(object.indices.begin(), object.indices.end());
    std::cout << "object of " << object.indices.size() << " points\n";
    takeApart(segmentation, object.indices);
  }
  return 0;
}

} // namespace

int
main(int argc, char** argv)
{
  try {
    if (argc == 2)
      return run(argv[1]);
    std::cerr << "usage: table_objects CLOUD.pcd\n";
    return 2;
  }
  catch (const std::exception& error) {
    std::cerr << "table_objects: " << error.what() << '\n';
    return 1;
  }
}
