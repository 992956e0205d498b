#include "report/point_share.h"

#include <holdfast/geometry/constants.h>

#include <pcl/kdtree/kdtree_flann.h>

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>
#include <random>

namespace holdfast::app {
namespace {

constexpr int kNeighbors = 40; // of the full cloud: smooths their noise

/// Indices in ascending order (Knuth's algorithm S: every choice is as likely).
std::vector<std::size_t>
evenChoice(std::size_t size, std::size_t count)
{
  std::vector<std::size_t> chosen;
  std::mt19937 generator(20240917);
  for (std::size_t i = 0; i < size && chosen.size() < count; ++i) {
    const double draw = static_cast<double>(generator()) / 4294967296.0;
    if (draw * static_cast<double>(size - i) <
        static_cast<double>(count - chosen.size()))
      chosen.push_back(i);
  }
  return chosen;
}

pcl::PointCloud<pcl::PointXYZ>::Ptr
toPcl(const std::vector<Eigen::Vector3d>& positions)
{
  auto cloud = pcl::make_shared<pcl::PointCloud<pcl::PointXYZ>>();
  for (const Eigen::Vector3d& p : positions)
    cloud->emplace_back(static_cast<float>(p.x()),
                        static_cast<float>(p.y()),
                        static_cast<float>(p.z()));
  return cloud;
}

/// Of the plane through points, by the least eigenvalue of their scatter.
Eigen::Vector3d
normalOf(const std::vector<Eigen::Vector3d>& positions, const std::vector<int>& indices)
{
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const int i : indices)
    middle += positions[static_cast<std::size_t>(i)];
  middle /= static_cast<double>(indices.size());
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const int i : indices) {
    const Eigen::Vector3d d = positions[static_cast<std::size_t>(i)] - middle;
    scatter += d * d.transpose();
  }
  return Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(scatter).eigenvectors().col(0);
}

/// 0 to 255; both sides of a surface are lit.
std::uint8_t
shadeOf(const Eigen::Vector3d& normal, const Pose& sensor)
{
  const Eigen::Vector3d lamp = Eigen::Vector3d(-0.5, -0.75, -0.75).normalized();
  constexpr double kDarkest = 96.0, kLightest = 222.0;
  const double facing = std::abs((sensor.R.transpose() * normal).dot(lamp));
  return static_cast<std::uint8_t>(
      std::lround(kDarkest + (kLightest - kDarkest) * facing));
}

} // namespace

PointShare
shareOf(const SeenCloud& cloud, std::size_t count)
{
  const PicturePoints& points = cloud.points;
  PointShare share;
  if (points.positions.empty() || count == 0)
    return share;
  pcl::KdTreeFLANN<pcl::PointXYZ> tree(false);
  tree.setInputCloud(toPcl(points.positions));
  const bool has_colors = !points.colors.empty();
  std::vector<int> indices;
  std::vector<float> squared;
  std::vector<double> gaps;
  for (const std::size_t i : evenChoice(points.positions.size(), count)) {
    const Eigen::Vector3d& at = points.positions[i];
    share.positions.push_back(at);
    tree.nearestKSearch(static_cast<int>(i), kNeighbors, indices, squared);
    gaps.push_back(std::sqrt(static_cast<double>(squared.back()) /
                             static_cast<double>(squared.size())));
    if (has_colors)
      share.colors.insert(share.colors.end(),
                          points.colors[i].begin(),
                          points.colors[i].end());
    else
      share.colors.push_back(
          shadeOf(normalOf(points.positions, indices), cloud.sensor_pose));
  }
  const auto middle = gaps.begin() + static_cast<std::ptrdiff_t>(gaps.size() / 2);
  std::nth_element(gaps.begin(), middle, gaps.end());
  // On a grid n points lie within sqrt(n / pi) of its spacing.
  share.spacing = *middle * std::sqrt(kPi) *
                  std::sqrt(static_cast<double>(points.positions.size()) /
                            static_cast<double>(share.positions.size()));
  return share;
}

} // namespace holdfast::app
