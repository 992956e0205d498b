/// \file Batches of noisy points on the patches of the reference scenes.
#pragma once

#include "support/random.h"

#include <holdfast/fit/options.h>
#include <holdfast/fit/point_batch.h>
#include <holdfast/patch/parameters.h>
#include <holdfast/sensor/stereo_noise_model.h>
#include <holdfast/simulation/reference_scenes.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

namespace holdfast::test {

/// Points with their covariances, world frame.
struct Sample {
  std::vector<Eigen::Vector3d> points;
  std::vector<Eigen::Matrix3d> covariances;
  Eigen::Vector3d viewpoint = Eigen::Vector3d::Zero();
};

/// Fills a batch about the sample's first point.
inline void
fillBatch(const Sample& sample, PointBatch& batch)
{
  batch.clear(sample.points.empty() ? Eigen::Vector3d::Zero() : sample.points.front(),
              sample.viewpoint);
  for (std::size_t i = 0; i < sample.points.size(); ++i)
    batch.add(sample.points[i], sample.covariances[i]);
}

inline PointBatch
batchOf(const Sample& sample)
{
  PointBatch batch;
  fillBatch(sample, batch);
  return batch;
}

/// The noise of the paper's Kinect.
inline StereoNoiseModel
kinectNoise()
{
  return StereoNoiseModel(StereoNoiseModel::Parameters{});
}

/// The points of a reference scene that hit its patch, without noise, and what noise
/// they would have.
struct CleanSample {
  std::vector<Eigen::Vector3d> points;
  std::vector<Eigen::Matrix3d> covariances, roots;
  Eigen::Vector3d viewpoint = Eigen::Vector3d::Zero();
};

inline CleanSample
cleanSample(const ReferenceScene& scene, double noise_scale = 1.0)
{
  RangeImage image = castRays(scene.scene, scene.rays);
  attachNoise(image, kinectNoise());
  CleanSample sample;
  sample.viewpoint = image.sensor_pose.c;
  for (std::size_t i = 0; i < image.truth.size(); ++i)
    if (image.hits[i] >= 0) {
      sample.points.push_back(image.truth[i]);
      sample.roots.push_back(noise_scale * image.roots[i]);
      sample.covariances.push_back(image.covariances[i]);
    }
  return sample;
}

/// Noise drawn once.
inline Sample
noisy(const CleanSample& clean, std::mt19937_64& generator)
{
  Sample sample;
  sample.viewpoint = clean.viewpoint;
  sample.covariances = clean.covariances;
  drawNoise(clean.points, clean.roots, generator, sample.points);
  return sample;
}

/// The points of a reference scene that hit its patch, noise drawn once.
inline Sample
sampleScene(const ReferenceScene& scene, double noise_scale, std::mt19937_64& generator)
{
  return noisy(cleanSample(scene, noise_scale), generator);
}

/// A robot scene from a distance of 0.8-1.2 m, any azimuth and a tilt of 0.2-0.8 rad.
inline Sample
robotSample(PatchType type, double noise_scale, Random& random)
{
  const double distance = random.uniform(0.8, 1.2);
  const double tilt = random.uniform(0.2, 0.8);
  const double azimuth = random.uniform(0.0, 6.28);
  return sampleScene(robotScene(type, distance, tilt, azimuth),
                     noise_scale,
                     random.engine());
}

/// The sample seen from another frame: points T q, covariances R Sigma R^T.
inline Sample
transformed(const Sample& sample, const Pose& T)
{
  Sample moved = sample;
  for (Eigen::Vector3d& point : moved.points)
    point = T.toWorld(point);
  for (Eigen::Matrix3d& covariance : moved.covariances)
    covariance = (T.R * covariance * T.R.transpose()).eval();
  moved.viewpoint = T.toWorld(sample.viewpoint);
  return moved;
}

/// Bumps of some centimetres across that no patch can follow; the patches of the scenes
/// lie in the xy plane.
inline void
addBumps(Sample& sample, double amplitude_m, double waves_per_m)
{
  const double w = 6.283 * waves_per_m;
  for (Eigen::Vector3d& q : sample.points)
    q.z() += amplitude_m * std::sin(w * q.x()) * std::cos(0.8 * w * q.y() + 1.0);
}

/// Largest |A_ij - B_ij| / sqrt(B_ii B_jj): the difference of two covariances in units
/// of correlation.
inline double
normalizedDifference(const ParameterMatrix& A, const ParameterMatrix& B)
{
  double largest = 0.0;
  for (int i = 0; i < B.rows(); ++i)
    for (int j = 0; j < B.cols(); ++j) {
      const double difference =
          std::abs(A(i, j) - B(i, j)) / std::sqrt(B(i, i) * B(j, j));
      // Written so that NaN comes through.
      if (!(difference <= largest))
        largest = difference;
    }
  return largest;
}

/// Options that force a type, so that no test decides.
inline FitOptions
optionsFor(PatchType type, const FitOptions& options = {})
{
  return withType(options, type);
}

inline std::string
typeName(PatchType type)
{
  return std::string(surfaceName(type.surface)) + "_" +
         std::string(boundaryName(type.boundary));
}

} // namespace holdfast::test
