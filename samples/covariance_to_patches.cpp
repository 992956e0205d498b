// The noise of every point of a depth image, and patches all over it with the
// covariances that follow from the noise.
//
//   covariance_to_patches samples/rocks.pcd
#include <holdfast/io/config.h>
#include <holdfast/patch/parameters.h>
#include <holdfast/pcl/patch_estimation.h>
#include <holdfast/pcl/range_covariance_estimation.h>

#include <pcl/io/pcd_io.h>

#include <Eigen/Eigenvalues>

#include <cmath>
#include <exception>
#include <iostream>
#include <memory>
#include <string>

using Cloud = pcl::PointCloud<pcl::PointXYZ>;

namespace {

// Largest standard deviation of a point in any direction, m.
float
worstSigma(const Eigen::Matrix3f& covariance)
{
  return std::sqrt(covariance.selfadjointView<Eigen::Lower>().eigenvalues().maxCoeff());
}

void
printPatch(const holdfast::FitResult& fit)
{
  std::cout << holdfast::surfaceName(fit.patch.type.surface) << ", " << fit.points
            << " points\n";
  const auto names = holdfast::parameterNames(fit.patch.type);
  const auto values = holdfast::pack(fit.patch);
  for (Eigen::Index i = 0; i < values.size(); ++i)
    std::cout << "  " << names[static_cast<std::size_t>(i)] << " = " << values[i]
              << " +- " << std::sqrt(fit.covariance(i, i)) << '\n';
}

int
run(const std::string& path)
{
  auto cloud = pcl::make_shared<Cloud>();
  if (pcl::io::loadPCDFile(path, *cloud) != 0)
    return 1;
  const holdfast::Sensor sensor = holdfast::loadSensor("kinect_v1");

  // One 3x3 matrix per point, from the sensor's model and its pose in the cloud.
  holdfast::RangeCovarianceEstimation<pcl::PointXYZ> noise;
  noise.setInputCloud(cloud);
  noise.setSensor(sensor);
  const auto covariances = std::make_shared<holdfast::Covariances>();
  noise.computeCovariances(*covariances);
  for (std::size_t i = cloud->size() / 2; i < covariances->size(); ++i)
    if ((*covariances)[i].allFinite()) {
      std::cout << "point " << i << ": sigma up to "
                << 1e3F * worstSigma((*covariances)[i]) << " mm\n";
      break;
    }

  // Covariances may come from anywhere. Where they come from a model, it does better
  // inside the estimation (setSensor() instead), which evaluates it at the surface.
  holdfast::PatchEstimation<pcl::PointXYZ> estimation;
  estimation.setInputCloud(cloud);
  estimation.setInputCovariances(covariances);
  estimation.setSeedsFromSampler(true); // a grid, 5 cm apart
  estimation.setRadiusSearch(0.05);
  holdfast::ValidationOptions limits;
  limits.max_chi2_per_dof = 1.5;
  limits.min_coverage = 0.6;
  estimation.setValidationOptions(limits);
  pcl::PointCloud<holdfast::PatchPoint> patches;
  estimation.compute(patches);

  // Behind every point stands the fit in double precision.
  const auto found = holdfast::acceptedAmong(estimation.getResults());
  std::cout << found.size() << " patches at " << patches.size() << " seeds\n";
  for (std::size_t i = 0; i < found.size(); i += 50)
    printPatch(found[i].fit);
  return found.empty() ? 1 : 0;
}

} // namespace

int
main(int argc, char** argv)
{
  try {
    if (argc == 2)
      return run(argv[1]);
    std::cerr << "usage: covariance_to_patches CLOUD.pcd\n";
    return 2;
  }
  catch (const std::exception& error) {
    std::cerr << "covariance_to_patches: " << error.what() << '\n';
    return 1;
  }
}
