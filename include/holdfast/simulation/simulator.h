/// \file Range images of simulated scenes, with noise drawn from a sensor's model.
#pragma once

#include <holdfast/sensor/sensor.h>
#include <holdfast/simulation/pattern_field.h>
#include <holdfast/simulation/scene.h>

#include <memory>
#include <random>
#include <vector>

namespace holdfast {

/// The rays of an image, row by row, in the camera frame and with z = 1.
struct RayGrid {
  int width = 0;
  int height = 0;
  std::vector<Eigen::Vector3d> directions;
};

/// n x n rays through the middles of equal cells of a square frustum: x and y run over
/// +-tan(fov/2) (n-1)/n.
/// \param fov_rad full opening angle, in (0, pi).
/// \throw std::invalid_argument when an argument makes no sense.
RayGrid frustumRays(int n, double fov_rad);

/// The rays through pixels 0, stride, 2 stride, ... of each row and column.
/// \throw std::invalid_argument when stride is not positive.
RayGrid pixelRays(const Camera& camera, int stride = 1);

/// The pose of a camera at `position` that sees `target` in its middle and `up` (any
/// length) upright in its image.
/// \throw std::invalid_argument when the line of sight has no length or runs along up.
Pose lookAt(const Eigen::Vector3d& position,
            const Eigen::Vector3d& target,
            const Eigen::Vector3d& up);

/// One range image, pixels row by row. World frame; NaN where the ray meets nothing
/// within the sensor's range.
struct RangeImage {
  int width = 0;
  int height = 0;
  Pose sensor_pose;
  std::vector<Eigen::Vector3d> directions; ///< rays from sensor_pose.c, camera z = 1
  std::vector<int> hits; ///< Hit::index, -1 for nothing
  std::vector<Eigen::Vector3d> truth; ///< without noise, m
  std::vector<Eigen::Vector3d> points; ///< as measured, m
  /// Of the noise of a single point, m^2: at the true point, as it was drawn.
  std::vector<Eigen::Matrix3d> covariances;
  /// S with S S^T = covariance of what is a point's own of that noise: all of it, or
  /// where there is a pattern what is left of it.
  std::vector<Eigen::Matrix3d> roots;
  /// The noise that neighbouring pixels share; null and empty: none.
  std::shared_ptr<const PatternField> pattern;
  /// NoiseModel::patternDirection() at the true points, times the scale of the noise.
  std::vector<Eigen::Vector3d> pattern_directions;
};

/// The image without noise: points are the truth, covariances and roots zero.
RangeImage castRays(const Scene& scene,
                    const RayGrid& rays,
                    double min_range_m = 0.0,
                    double max_range_m = 1e3);

/// Sets covariances and roots to those of the model at the true points, with standard
/// deviations times noise_scale (>= 0): noise without pattern.
void attachNoise(RangeImage& image, const NoiseModel& noise, double noise_scale = 1.0);

/// The same with the sensor's pattern, if it has one, at the pixels of its camera that
/// the rays meet. Where a model leaves a pattern less room than it takes (khoshelham
/// far from the optical axis, with hardly any white part), the covariance is that of
/// the pattern and of what is left across it.
/// \throw std::invalid_argument when there is a pattern and the rays do not lie on rows
/// and columns of the sensor's camera.
void attachNoise(RangeImage& image, const Sensor& sensor, double noise_scale = 1.0);

/// out[i] = truth[i] + roots[i] n, n ~ N(0, I). Points that are NaN stay so and take
/// nothing from the generator. Cheap: made for many draws on the same truth.
/// \throw std::invalid_argument when truth and roots differ in length.
void drawNoise(const std::vector<Eigen::Vector3d>& truth,
               const std::vector<Eigen::Matrix3d>& roots,
               std::mt19937_64& generator,
               std::vector<Eigen::Vector3d>& out);

/// The same of an image with what its pixels share, if anything: that is drawn last,
/// for all pixels, so that without it the generator gives what it gives above.
void drawNoise(const RangeImage& image,
               std::mt19937_64& generator,
               std::vector<Eigen::Vector3d>& out);

/// Rounds the disparity of each point to the sensor's quantum: the point moves along
/// its ray to the depth of the nearest step; NaN where that is disparity zero.
/// \throw std::invalid_argument when the sensor does not quantise.
void quantizeDisparity(RangeImage& image, const Sensor& sensor);

struct SimulationOptions {
  double noise_scale = 1.0; ///< factor on the standard deviations
  bool quantize = false; ///< round disparities, after the noise
};

/// The whole road: rays, noise with the sensor's pattern, quantisation.
/// \throw std::invalid_argument when an option makes no sense for the sensor, or rays
/// for its pattern (attachNoise).
RangeImage simulate(const Scene& scene,
                    const RayGrid& rays,
                    const Sensor& sensor,
                    const SimulationOptions& options,
                    std::mt19937_64& generator);

} // namespace holdfast
