/// \file A surface whose derivatives are known.
#pragma once

#include <holdfast/geometry/pose.h>
#include <holdfast/simulation/shape.h>

#include <Eigen/Core>

namespace holdfast {

/// z = polynomial of third degree in x and y over a disc of the xy plane of a pose.
class Relief : public Shape {
public:
  /// \param second derivatives xx xy yy, 1/m; third: xxx xxy xyy yyy, 1/m^2; value and
  ///        slope are zero at the origin of the pose.
  /// \param radius of the disc, m; the surface must be no steeper than 45 degrees
  /// there. \throw std::invalid_argument when an argument makes no sense.
  Relief(const Pose& pose,
         const Eigen::Vector3d& second,
         const Eigen::Vector4d& third,
         double radius);
  std::optional<double> intersect(const Eigen::Vector3d& origin,
                                  const Eigen::Vector3d& direction) const override;
  std::string name() const override;
  std::vector<ShapeParameter> parameters() const override;

private:
  double heightAt(double x, double y) const;
  Eigen::Vector2d slopeAt(double x, double y) const;

  Pose pose_;
  Eigen::Vector3d second_;
  Eigen::Vector4d third_;
  double radius_;
};

} // namespace holdfast
