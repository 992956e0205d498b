/// \file Clouds of a patch among clutter, for the tests of sample consensus.
#pragma once

#include "support/random.h"

#include <holdfast/patch_estimator.h>
#include <holdfast/pcl/conversions.h>
#include <holdfast/sensor/stereo_noise_model.h>
#include <holdfast/simulation/reference_scenes.h>
#include <holdfast/validation/residual.h>

#include <pcl/point_types.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>
#include <ostream>
#include <string>
#include <vector>

namespace holdfast::test {

/// A patch of the reference scenes seen by a Kinect, its points in random order among
/// clutter anywhere up to 0.2 m above and below its 0.2 x 0.2 m.
struct ConsensusScene {
  Patch patch;
  pcl::PointCloud<pcl::PointXYZ>::Ptr cloud;
  CovariancesConstPtr covariances;
  NoiseModel::ConstPtr noise;
  std::vector<Eigen::Vector3d> truth; ///< points of the patch without noise
  std::vector<Eigen::Matrix3d> truth_covariances; ///< of the noise that was drawn
  std::vector<bool> on_patch; ///< by index into the cloud
};

/// \param outlier_share of all points, in [0, 1).
inline ConsensusScene
makeConsensusScene(PatchType type,
                   double outlier_share,
                   Random& random,
                   double noise_scale = 1.0)
{
  // From nearly above: seen from aside, the points lie unevenly about a paraboloid's
  // axis, and the line its vertex is sought on is another.
  const double tilt = random.uniform(0.0, 0.2);
  const ReferenceScene calibration =
      robotScene(type, 1.0, tilt, random.uniform(0.0, 6.28));
  ConsensusScene scene;
  StereoNoiseModel::Parameters parameters;
  parameters.sigma_disparity_px *= noise_scale;
  parameters.sigma_point_px *= noise_scale;
  scene.noise = std::make_shared<const StereoNoiseModel>(parameters);
  RangeImage image = castRays(calibration.scene, calibration.rays);
  attachNoise(image, *scene.noise);
  scene.patch = calibration.scene.patches.front();

  std::vector<Eigen::Vector3d> points;
  std::vector<Eigen::Matrix3d> roots;
  for (std::size_t i = 0; i < image.truth.size(); ++i)
    if (image.hits[i] >= 0) {
      scene.truth.push_back(image.truth[i]);
      scene.truth_covariances.push_back(image.covariances[i]);
      roots.push_back(image.roots[i]);
    }
  drawNoise(scene.truth, roots, random.engine(), points);
  const std::size_t inliers = points.size();
  const auto total =
      static_cast<std::size_t>(static_cast<double>(inliers) / (1.0 - outlier_share));
  while (points.size() < total)
    points.push_back(
        random.uniformVector(-0.1, 0.1).cwiseProduct(Eigen::Vector3d(1.0, 1.0, 2.0)));

  std::vector<std::size_t> order(points.size());
  std::iota(order.begin(), order.end(), 0U);
  std::shuffle(order.begin(), order.end(), random.engine());
  const Pose& pose = image.sensor_pose;
  auto covariances = std::make_shared<Covariances>();
  scene.cloud = pcl::make_shared<pcl::PointCloud<pcl::PointXYZ>>();
  scene.cloud->sensor_origin_ << pose.c.cast<float>(), 0.0F;
  scene.cloud->sensor_orientation_ = Eigen::Quaterniond(pose.R).cast<float>();
  for (const std::size_t i : order) {
    pcl::PointXYZ point;
    point.getVector3fMap() = points[i].cast<float>();
    scene.cloud->push_back(point);
    covariances->push_back(
        rotateCovariance(pose.R, scene.noise->covariance(pose.toLocal(points[i])))
            .cast<float>());
    scene.on_patch.push_back(i < inliers);
  }
  scene.covariances = covariances;
  return scene;
}

/// Standard deviation, m, of a fitted surface at a point near it: that of the distance
/// from the point, from the covariance of the fit.
inline double
surfaceSigma(const FitResult& fit, const Eigen::Vector3d& point)
{
  constexpr double kStep = 1e-6; // of 1 m, 1 rad, 1/m
  const ParameterVector parameters = pack(fit.patch);
  ParameterVector gradient(parameters.size());
  for (Eigen::Index i = 0; i < parameters.size(); ++i) {
    ParameterVector low = parameters, high = parameters;
    low[i] -= kStep;
    high[i] += kStep;
    gradient[i] = (distanceToSurface(unpack(fit.patch.type, high), point) -
                   distanceToSurface(unpack(fit.patch.type, low), point)) /
                  (2.0 * kStep);
  }
  return std::sqrt(gradient.dot(fit.covariance * gradient));
}

/// A kind of surface to look for, and what there is to find.
struct ConsensusCase {
  SurfaceRequest request;
  PatchType type;
  const char* name;
};

inline void
PrintTo(const ConsensusCase& c, std::ostream* out)
{
  *out << c.name;
}

inline std::string
consensusCaseName(const testing::TestParamInfo<ConsensusCase>& info)
{
  return info.param.name;
}

inline ConsensusCase
consensusCase(SurfaceRequest request, SurfaceType surface, const char* name)
{
  return {request, {surface, defaultBoundary(surface)}, name};
}

inline std::vector<ConsensusCase>
consensusCases()
{
  using Request = SurfaceRequest;
  using Surface = SurfaceType;
  return {
      consensusCase(Request::Plane, Surface::Plane, "plane"),
      consensusCase(Request::Sphere, Surface::Sphere, "sphere"),
      consensusCase(Request::CircularCylinder, Surface::CircularCylinder, "cylinder"),
      consensusCase(Request::Auto, Surface::EllipticParaboloid, "any_patch"),
      consensusCase(Request::Paraboloid, Surface::HyperbolicParaboloid, "paraboloid"),
      consensusCase(Request::EllipticParaboloid,
                    Surface::EllipticParaboloid,
                    "elliptic_paraboloid"),
      consensusCase(Request::HyperbolicParaboloid,
                    Surface::HyperbolicParaboloid,
                    "hyperbolic_paraboloid"),
      consensusCase(Request::CylindricParaboloid,
                    Surface::CylindricParaboloid,
                    "cylindric_paraboloid"),
      consensusCase(Request::CircularParaboloid,
                    Surface::CircularParaboloid,
                    "circular_paraboloid"),
  };
}

} // namespace holdfast::test
