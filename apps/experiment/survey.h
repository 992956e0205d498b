/// \file A surveyed cloud as a surface that a simulated sensor can see.
#pragma once

#include <holdfast/simulation/shape.h>

#include <pcl/kdtree/kdtree_flann.h>
#include <pcl/point_types.h>

namespace holdfast::app {

/// The surface through the points of a dense cloud: the plane through the points near
/// by, which count less the farther away they are (moving least squares of degree one).
class SurveyedSurface : public Shape {
public:
  /// \param spacing_m between neighbouring points.
  SurveyedSurface(const pcl::PointCloud<pcl::PointXYZ>::ConstPtr& points,
                  double spacing_m);

  std::optional<double> intersect(const Eigen::Vector3d& origin,
                                  const Eigen::Vector3d& direction) const override;
  std::string name() const override;
  std::vector<ShapeParameter> parameters() const override;

  /// The point of largest z.
  Eigen::Vector3d highestPoint() const;

private:
  struct Plane {
    Eigen::Vector3d center;
    Eigen::Vector3d normal;
    double nearest_m; ///< distance of the nearest point
  };
  Plane planeNear(const Eigen::Vector3d& position) const;

  pcl::PointCloud<pcl::PointXYZ>::ConstPtr points_;
  pcl::KdTreeFLANN<pcl::PointXYZ> tree_;
  double spacing_m_;
  Eigen::Vector3d low_, high_; ///< bounding box
};

} // namespace holdfast::app
