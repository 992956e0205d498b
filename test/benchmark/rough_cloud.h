/// \file The scene of the benchmarks: rough ground in a 640x480 image.
#pragma once

#include <holdfast/fit/point_batch.h>
#include <holdfast/pcl/neighborhood_sampler.h>

#include <vector>

namespace holdfast::benchmarks {

/// Waves of 0.1 m and curvatures up to 20/m, 0.8 m away, seen by a stereo camera with a
/// tenth of a Kinect's noise: at that noise the curvature of patches of 100 pixels
/// shows, so that the fit goes all its way instead of ending at a plane.
struct Scene {
  RangeCloud cloud;
  Sensor sensor;
};

Scene makeScene();

/// About ten thousand seeds, on a grid.
SamplerOptions makeSamplerOptions(Neighborhood neighborhood, double radius_m);

/// The radius at which neighbourhoods have `points` points on average.
double radiusFor(const Scene& scene, Neighborhood neighborhood, int points);

/// Points per neighbourhood, averaged over the seeds.
double meanSize(const Scene& scene, const SamplerOptions& options);

/// The neighbourhoods with their covariances, ready to be fitted.
std::vector<PointBatch> gatherBatches(const Scene& scene,
                                      const SamplerOptions& options);

} // namespace holdfast::benchmarks
