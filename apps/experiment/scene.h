/// \file What the experiments have in common: known scenes, and the paper's metrics.
#pragma once

#include "report.h"

#include <holdfast/evaluation/metrics.h>
#include <holdfast/fit/point_batch.h>
#include <holdfast/pcl/range_cloud.h>
#include <holdfast/simulation/simulator.h>

#include <array>
#include <random>
#include <string>

namespace holdfast::app {

/// "sphere", "plane_quad", ...: the surface, of planes with the boundary.
std::string typeName(PatchType type);

/// The noise of the paper's Kinect: 0.35 px, 0.17 px of disparity, f = 580 px.
NoiseModel::ConstPtr kinectNoise();

/// The scene of makeScene() as a camera sees it that looks at its middle, or up to
/// spread_m beside it, from 1.0 to 1.2 m, any side and 30 to 63 degrees above.
Scene randomView(const std::string& name,
                 std::mt19937_64& generator,
                 double spread_m = 0.0);

/// The points without noise of those pixels that see the scene's first patch, with the
/// covariances of the noise they would have.
PointBatch noiseFreeBatch(const Scene& scene,
                          const RayGrid& rays,
                          const NoiseModel& noise);

/// The measured points as an organized cloud.
RangeCloud cloudOf(const RangeImage& image);

/// The true points likewise.
RangeCloud trueCloudOf(const RangeImage& image);

/// Puts the true points in the place of those that were gathered, whose covariances
/// stay.
void takeTruth(const RangeImage& image,
               const std::vector<int>& indices,
               PointBatch& batch);

/// One of the paper's metrics, to loop over.
struct Metric {
  const char* name; ///< "Phi_d"
  const char* unit;
  MeanAndVariance PatchMetrics::*value;
};

/// In the order of the paper's Table I.
inline constexpr std::array<Metric, 5> kMetrics{{
    {"Phi_d", "m", &PatchMetrics::phi_d},
    {"Phi_k", "1/m", &PatchMetrics::phi_k},
    {"Phi_5", "rad", &PatchMetrics::phi_5},
    {"Phi_6", "rad", &PatchMetrics::phi_6},
    {"Phi_t", "m", &PatchMetrics::phi_t},
}};

/// Adds KEY_mean and KEY_variance to a row.
void addMeanAndVariance(Json& row,
                        const std::string& key,
                        const MeanAndVariance& value);

} // namespace holdfast::app
