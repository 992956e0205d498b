// PCL's RANSAC with our cylinder: somebody points at a pixel, and we say how thick the
// pipe is that runs there, and how sure that is.
//
//   holdfast simulate mix -o mix.pcd
//   cylinder_in_clutter mix.pcd 230 300     a column and a row
#include <holdfast/io/config.h>
#include <holdfast/pcl/sac_model_patch.h>

#include <pcl/common/point_tests.h>
#include <pcl/filters/crop_box.h>
#include <pcl/io/pcd_io.h>
#include <pcl/sample_consensus/ransac.h>

#include <cmath>
#include <exception>
#include <iostream>
#include <string>

using Cloud = pcl::PointCloud<pcl::PointXYZ>;
using Cylinder = holdfast::SampleConsensusModelPatch<pcl::PointXYZ>;

namespace {

// Everything up to 15 cm from a point: the pipe, and what lies about.
pcl::Indices
cubeAround(const Cloud::ConstPtr& cloud, const pcl::PointXYZ& center)
{
  const Eigen::Vector4f reach(0.15F, 0.15F, 0.15F, 0.0F);
  pcl::CropBox<pcl::PointXYZ> crop;
  crop.setInputCloud(cloud);
  crop.setMin(center.getVector4fMap() - reach);
  crop.setMax(center.getVector4fMap() + reach);
  pcl::Indices inside;
  crop.filter(inside);
  return inside;
}

void
print(const holdfast::FitResult& fit)
{
  // The parameters are d_x d_y kappa ...; R = 1/|kappa|, so sigma_R = R^2 sigma_kappa.
  const double radius = 1.0 / std::abs(fit.patch.kappa[0]);
  const double sigma = radius * radius * std::sqrt(fit.covariance(2, 2));
  std::cout << "radius " << 1e3 * radius << " mm, sigma " << 1e3 * sigma << " mm\n"
            << "axis " << fit.patch.pose().R.col(0).transpose() << '\n'
            << "chi2/dof " << holdfast::chi2PerDof(fit) << ", " << fit.points
            << " points\n";
}

int
run(const std::string& path, int column, int row)
{
  auto cloud = pcl::make_shared<Cloud>();
  if (pcl::io::loadPCDFile(path, *cloud) != 0)
    return 1;
  const pcl::PointXYZ center = cloud->at(column, row);
  if (!pcl::isFinite(center)) {
    std::cerr << "cylinder_in_clutter: nothing was measured in that pixel\n";
    return 1;
  }

  auto model = pcl::make_shared<Cylinder>(holdfast::SurfaceRequest::CircularCylinder,
                                          cloud,
                                          cubeAround(cloud, center));
  model->setSensor(holdfast::loadSensor("kinect_v1"));
  model->setRadiusLimits(0.01, 0.1);
  // Near or far, a point within three of its own sigmas is an inlier: with a sensor,
  // the model measures distances in sigmas, and PCL passes its threshold on to the
  // model.
  constexpr double kSigmas = 3.0;
  pcl::RandomSampleConsensus<pcl::PointXYZ> ransac(model, kSigmas);
  ransac.setMaxIterations(10000);
  if (!ransac.computeModel() || !ransac.refineModel())
    return 1;
  pcl::Indices inliers;
  Eigen::VectorXf coefficients;
  ransac.getInliers(inliers);
  ransac.getModelCoefficients(coefficients);

  const holdfast::FitResult fit = model->estimatePatch(inliers, coefficients);
  std::cout << holdfast::statusName(fit.status) << '\n';
  if (!holdfast::isUsable(fit.status))
    return 1;
  print(fit);
  return 0;
}

} // namespace

int
main(int argc, char** argv)
{
  try {
    if (argc == 4)
      return run(argv[1], std::stoi(argv[2]), std::stoi(argv[3]));
    std::cerr << "usage: cylinder_in_clutter CLOUD.pcd COLUMN ROW\n";
    return 2;
  }
  catch (const std::exception& error) {
    std::cerr << "cylinder_in_clutter: " << error.what() << '\n';
    return 1;
  }
}
