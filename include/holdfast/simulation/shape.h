/// \file What simulated scenes are made of, besides patches.
#pragma once

#include <holdfast/geometry/pose.h>

#include <Eigen/Core>

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace holdfast {

/// A named value of a shape, for the description of a scene; metres and radians.
struct ShapeParameter {
  ShapeParameter(std::string its_name, double value)
  : name(std::move(its_name)), values{value}
  {}
  ShapeParameter(std::string its_name, const Eigen::Vector3d& v)
  : name(std::move(its_name)), values{v.x(), v.y(), v.z()}
  {}

  std::string name;
  std::vector<double> values;
};

/// A solid or sheet that rays can hit. World frame, metres.
class Shape {
public:
  virtual ~Shape() = default;

  /// The smallest t >= 0 at which origin + t direction meets the surface; nothing where
  /// it misses. `direction` need not be a unit vector.
  virtual std::optional<double> intersect(const Eigen::Vector3d& origin,
                                          const Eigen::Vector3d& direction) const = 0;

  /// A t that intersect() does not fall below, and cheaper: what something nearer hides
  /// need not be looked for. Infinite where the ray misses for sure.
  virtual double nearestPossible(const Eigen::Vector3d& /*origin*/,
                                 const Eigen::Vector3d& /*direction*/) const
  {
    return 0.0;
  }

  virtual std::string name() const = 0;
  virtual std::vector<ShapeParameter> parameters() const = 0;
};

/// A sphere.
class Ball : public Shape {
public:
  Ball(const Eigen::Vector3d& center, double radius);
  std::optional<double> intersect(const Eigen::Vector3d& origin,
                                  const Eigen::Vector3d& direction) const override;
  std::string name() const override;
  std::vector<ShapeParameter> parameters() const override;

private:
  Eigen::Vector3d center_;
  double radius_;
};

/// A cuboid; a step of stairs, a table top, the ground.
class Box : public Shape {
public:
  /// \param pose of the centre; \param size full lengths along its axes.
  Box(const Pose& pose, const Eigen::Vector3d& size);
  std::optional<double> intersect(const Eigen::Vector3d& origin,
                                  const Eigen::Vector3d& direction) const override;
  std::string name() const override;
  std::vector<ShapeParameter> parameters() const override;

private:
  Pose pose_;
  Eigen::Vector3d size_;
};

/// A thin circular tube, open at both ends.
class Pipe : public Shape {
public:
  /// \param axis any length but zero.
  Pipe(const Eigen::Vector3d& center,
       const Eigen::Vector3d& axis,
       double radius,
       double length);
  std::optional<double> intersect(const Eigen::Vector3d& origin,
                                  const Eigen::Vector3d& direction) const override;
  std::string name() const override;
  std::vector<ShapeParameter> parameters() const override;

private:
  Eigen::Vector3d center_;
  Eigen::Vector3d axis_; ///< unit vector
  double radius_;
  double length_;
};

/// A smooth random function: a sum of sine waves whose directions, lengths and phases
/// follow from a seed.
class WaveSum {
public:
  /// \param amplitude largest possible value; \param wavelength the longest one, down
  /// to a third of it; \param planar waves run in the xy plane only.
  WaveSum(double amplitude, double wavelength, bool planar, std::uint64_t seed);

  double operator()(const Eigen::Vector3d& p) const;

  double amplitude() const
  {
    return amplitude_;
  }

  /// No slope is steeper.
  double maxSlope() const
  {
    return max_slope_;
  }

private:
  struct Wave {
    double amplitude;
    Eigen::Vector3d number; ///< direction times 2 pi / wavelength
    double phase;
  };
  std::vector<Wave> waves_;
  double amplitude_;
  double max_slope_ = 0.0;
};

/// Bumpy ground: a height field over a square.
class Terrain : public Shape {
public:
  /// \param size edge length.
  /// \param bump_height, bump_length amplitude and longest wavelength of the bumps.
  Terrain(const Eigen::Vector3d& center,
          double size,
          double bump_height,
          double bump_length,
          std::uint64_t seed);
  std::optional<double> intersect(const Eigen::Vector3d& origin,
                                  const Eigen::Vector3d& direction) const override;
  double nearestPossible(const Eigen::Vector3d& origin,
                         const Eigen::Vector3d& direction) const override;
  std::string name() const override;
  std::vector<ShapeParameter> parameters() const override;

  /// World z of the ground at (x, y), also beyond the square.
  double heightAt(double x, double y) const;

private:
  /// Half the size of the box that holds it.
  Eigen::Vector3d halfBox() const;

  Eigen::Vector3d center_;
  double size_;
  double bump_length_;
  std::uint64_t seed_;
  WaveSum bumps_;
};

/// A rock: an ellipsoid whose radius varies smoothly with the direction.
class Boulder : public Shape {
public:
  /// \param radii half-axes along the axes of the pose; \param roughness largest
  /// relative deviation from the ellipsoid, below 0.5.
  Boulder(const Pose& pose,
          const Eigen::Vector3d& radii,
          double roughness,
          std::uint64_t seed);
  std::optional<double> intersect(const Eigen::Vector3d& origin,
                                  const Eigen::Vector3d& direction) const override;
  double nearestPossible(const Eigen::Vector3d& origin,
                         const Eigen::Vector3d& direction) const override;
  std::string name() const override;
  std::vector<ShapeParameter> parameters() const override;

  /// Zero on the surface, negative inside: relative distance from the centre minus that
  /// of the surface in the same direction.
  double implicitValue(const Eigen::Vector3d& world) const;

private:
  Eigen::Vector3d toUnitBall(const Eigen::Vector3d& world) const;
  double unitBallValue(const Eigen::Vector3d& p) const;

  Pose pose_;
  Eigen::Vector3d radii_;
  std::uint64_t seed_;
  WaveSum bumps_;
  double outer_radius_ = 0.0; ///< of a ball around the centre that holds it
};

} // namespace holdfast
