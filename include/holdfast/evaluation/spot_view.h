/// \file Views of one spot of a simulated surface, and what is true of it: fusion
/// against the truth.
#pragma once

#include <holdfast/fusion/measurement.h>
#include <holdfast/patch_estimator.h>
#include <holdfast/sensor/sensor.h>
#include <holdfast/simulation/simulator.h>

#include <memory>
#include <optional>
#include <random>
#include <vector>

namespace holdfast {

/// A quadric and how well it is one.
struct BestQuadric {
  JetVector jet; ///< at the anchor
  double residual_m = 0.0; ///< root mean square over the disc, along the anchor's axis
};

/// The best quadric of a scene over a disc in the plane of an anchor, by least squares
/// along the anchor's axis, as its jet there: what a patch of the map estimates.
/// Its residual is large where the disc lies over an edge.
/// \return nothing where a part of the disc has no surface within two radii.
std::optional<BestQuadric> bestQuadric(const Scene& scene,
                                       const Pose& anchor,
                                       double radius_m);

/// The jet of bestQuadric().
std::optional<JetVector> trueJet(const Scene& scene,
                                 const Pose& anchor,
                                 double radius_m);

/// The pixels of a camera whose rays meet a scene within a disc.
class SpotView {
public:
  /// \param disc its plane: origin and z axis; rays count by where they meet the
  ///        surface, less its height over the plane.
  /// \param stride every so many rows and columns
  SpotView(const Scene& scene,
           const Sensor& sensor,
           const Pose& sensor_pose,
           const Pose& disc,
           double radius_m,
           int stride);

  int points() const
  {
    return static_cast<int>(points_.size());
  }

  /// Draws the error that pixels share, which stays until it is drawn again. Without
  /// that, and where the sensor has no pattern, there is none.
  void drawPattern(std::mt19937_64& generator);

  /// A fit to the points with noise of their own drawn anew, in the frame of the
  /// camera. \param estimator of paraboloids, with the pattern apart if there is one.
  std::optional<Measurement> measure(const PatchEstimator& estimator,
                                     std::mt19937_64& generator) const;

private:
  struct Point {
    Eigen::Vector3d truth; ///< frame of the camera
    Eigen::Vector2d pixel;
    Eigen::Matrix3d covariance, root; ///< of all noise; of what is its own
    Eigen::Vector3d shared; ///< direction of the shared error
    std::size_t in_window;
    double pattern; ///< drawn
  };

  std::vector<Point> points_;
  std::shared_ptr<const PatternField> field_;
  std::shared_ptr<const CorrelatedNoise> noise_;
};

} // namespace holdfast
