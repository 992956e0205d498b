/// \file Cameras that move through simulated scenes.
#pragma once

#include <holdfast/simulation/simulator.h>

#include <cstdint>
#include <random>
#include <vector>

namespace holdfast {

struct WalkOptions {
  double step_m = 0.1; ///< along the way from frame to frame
  double height_m = 1.2; ///< of the camera above the ground
  double down_rad = 0.785398163397448; ///< of its axis below the horizon
};

/// Poses of a camera that a walking robot carries along +x from Scene::walk_start,
/// looking ahead and down. It follows the ground, averaged over about half a metre,
/// bobs by 1.5 cm with every step of 0.4 m and sways from side to side, by 2 cm and 2
/// degrees, with every second one. Pose k does not depend on the number of frames.
/// \throw std::invalid_argument unless frames >= 1, step_m >= 0, height_m > 0 and
/// down_rad in (-pi/2, pi/2).
std::vector<Pose> walk(const Scene& scene, int frames, const WalkOptions& options = {});

/// Poses of a camera that goes around the middle of the scene, looking at it, from
/// Scene::sensor_pose on at the distance and height it has there, step_m along the
/// circle from frame to frame, counterclockwise seen from above.
/// \throw std::invalid_argument unless frames >= 1 and step_m >= 0, and when the camera
/// stands above the middle or looks past it.
std::vector<Pose> circle(const Scene& scene, int frames, double step_m = 0.1);

/// What a robot believes of its way.
struct Odometry {
  std::vector<Pose> poses; ///< the first is true, errors add up from there
  /// From pose k to pose k + 1: poses[k + 1] = poses[k] * increments[k].
  std::vector<Pose> increments;
};

/// The true increments of the poses, each with an error of its own: R <- R Exp(delta),
/// c <- c + tau, both isotropic and Gaussian, in the axes of the pose that the
/// increment leads to and comes from. Its covariance about (delta, c) is the diagonal
/// of sigma_rad^2 (three times) and sigma_m^2. \param sigma_rad, sigma_m per increment
/// and axis. \throw std::invalid_argument unless there is a pose and both sigmas are
/// finite and
/// >= 0.
Odometry noisyOdometry(const std::vector<Pose>& poses,
                       double sigma_rad,
                       double sigma_m,
                       std::mt19937_64& generator);

/// The image as its sensor has it: everything in the camera's frame, whose pose is the
/// identity.
RangeImage inSensorFrame(RangeImage image);

/// What a camera's frames have in common.
enum class PatternOverTime {
  Fixed, ///< what neighbouring pixels share stays with them, as in a camera
  Fresh ///< and is drawn anew for every frame
};

/// Images of one camera at many poses.
class FrameSimulator {
public:
  /// \param seed of everything that is drawn.
  /// \throw std::invalid_argument as simulate() does.
  FrameSimulator(Scene scene,
                 RayGrid rays,
                 Sensor sensor,
                 SimulationOptions options,
                 PatternOverTime pattern,
                 std::uint64_t seed);

  /// Frame k, taken from a pose. White noise is drawn anew for each k; which frames
  /// were asked for before makes no difference. World frame, as simulate().
  /// \param k >= 0.
  RangeImage frame(int k, const Pose& sensor_pose) const;

  /// The same in two steps, for cameras that differ in their noise alone: rays are what
  /// takes time. frame(k, pose) = withNoise(k, truth(pose)).
  RangeImage truth(const Pose& sensor_pose) const;
  RangeImage withNoise(int k, RangeImage image) const;

  /// Scene::sensor_pose of it is not used.
  const Scene& scene() const
  {
    return scene_;
  }

private:
  std::mt19937_64 generatorOf(std::uint32_t stream) const;
  void drawOnFixedPattern(std::mt19937_64& generator, RangeImage& image) const;

  Scene scene_;
  RayGrid rays_;
  Sensor sensor_;
  SimulationOptions options_;
  std::uint64_t seed_;
  std::vector<double> field_; ///< of the fixed pattern; empty: none
};

} // namespace holdfast
