#include "survey.h"

#include "parallel/thread_memory.h"

#include <pcl/common/common.h>

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>

namespace holdfast::app {
namespace {

constexpr int kNeighbors = 16;
constexpr int kMostSteps = 300;
// Where the nearest point is farther away than this many spacings, there is no surface.
constexpr double kReach = 2.5;
// The ray has arrived when a step is this short, in spacings.
constexpr double kArrived = 1e-3;
// |cos| of the angle of ray and normal below which a plane is too oblique to be hit.
constexpr double kOblique = 0.1;

} // namespace

SurveyedSurface::SurveyedSurface(const pcl::PointCloud<pcl::PointXYZ>::ConstPtr& points,
                                 double spacing_m)
: points_(points), spacing_m_(spacing_m)
{
  tree_.setInputCloud(points_);
  pcl::PointXYZ low, high;
  pcl::getMinMax3D(*points_, low, high);
  const double margin = kReach * spacing_m_;
  low_ = low.getVector3fMap().cast<double>().array() - margin;
  high_ = high.getVector3fMap().cast<double>().array() + margin;
}

SurveyedSurface::Plane
SurveyedSurface::planeNear(const Eigen::Vector3d& position) const
{
  auto& indices = threadMemory<std::vector<int>, struct NearestIndices>();
  auto& squared_distances = threadMemory<std::vector<float>, struct NearestDistances>();
  pcl::PointXYZ query;
  query.getVector3fMap() = position.cast<float>();
  tree_.nearestKSearch(query, kNeighbors, indices, squared_distances);
  double sum = 0.0;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < indices.size(); ++i) {
    const Eigen::Vector3d q = (*points_)[static_cast<std::size_t>(indices[i])]
                                  .getVector3fMap()
                                  .cast<double>() -
                              position;
    const double w = std::exp(-squared_distances[i] / (4.0 * spacing_m_ * spacing_m_));
    sum += w;
    mean += w * q;
    squares += w * q * q.transpose();
  }
  // Far from all points every weight vanishes; the caller does not use the plane then.
  mean /= std::max(sum, 1e-300);
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver;
  solver.computeDirect(squares / std::max(sum, 1e-300) - mean * mean.transpose());
  return {position + mean,
          solver.eigenvectors().col(0),
          std::sqrt(static_cast<double>(squared_distances.front()))};
}

std::optional<double>
SurveyedSurface::intersect(const Eigen::Vector3d& origin,
                           const Eigen::Vector3d& direction) const
{
  const double length = direction.norm();
  const Eigen::Vector3d ray = direction / length;
  // Slabs of the bounding box.
  const Eigen::Array3d a = (low_ - origin).array() / ray.array();
  const Eigen::Array3d b = (high_ - origin).array() / ray.array();
  double t = std::max(0.0, a.min(b).maxCoeff());
  const double end = a.max(b).minCoeff();
  const double reach = kReach * spacing_m_;
  for (int step = 0; step < kMostSteps && t <= end; ++step) {
    const Plane plane = planeNear(origin + t * ray);
    if (plane.nearest_m > reach) {
      // No surface nearer than this.
      t += std::max(plane.nearest_m - reach, 0.1 * spacing_m_);
      continue;
    }
    const double cosine = plane.normal.dot(ray);
    const double rest = plane.normal.dot(plane.center - origin - t * ray) / cosine;
    if (std::abs(cosine) < kOblique || std::abs(rest) > 2.0 * reach) {
      t += 0.5 * spacing_m_;
      continue;
    }
    t += rest;
    if (std::abs(rest) < kArrived * spacing_m_)
      return t / length;
  }
  return {};
}

std::string
SurveyedSurface::name() const
{
  return "survey";
}

std::vector<ShapeParameter>
SurveyedSurface::parameters() const
{
  return {{"spacing", spacing_m_}};
}

Eigen::Vector3d
SurveyedSurface::highestPoint() const
{
  const auto highest =
      std::max_element(points_->begin(),
                       points_->end(),
                       [](const auto& p, const auto& q) { return p.z < q.z; });
  return highest->getVector3fMap().cast<double>();
}

} // namespace holdfast::app
