/// \file Patches and what is known of them in PCL's viewer. Of headers alone: VTK stays
/// with the program that has the viewer.
#pragma once

#include <holdfast/patch/tessellation.h>
#include <holdfast/pcl/patch_extraction.h>

#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <pcl/visualization/pcl_visualizer.h>

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

namespace holdfast {

namespace detail {

/// Triangles of several things as one mesh of the viewer.
struct ViewerMesh {
  pcl::PointCloud<pcl::PointXYZRGB>::Ptr vertices =
      pcl::make_shared<pcl::PointCloud<pcl::PointXYZRGB>>();
  std::vector<pcl::Vertices> triangles;

  void add(const Mesh& mesh, const std::array<std::uint8_t, 3>& color)
  {
    const auto first = static_cast<pcl::index_t>(vertices->size());
    for (const Eigen::Vector3d& v : mesh.vertices) {
      pcl::PointXYZRGB point(color[0], color[1], color[2]);
      point.getVector3fMap() = v.cast<float>();
      vertices->push_back(point);
    }
    for (const auto& [a, b, c] : mesh.triangles) {
      pcl::Vertices triangle;
      triangle.vertices = {first + a, first + b, first + c};
      triangles.push_back(triangle);
    }
  }

  bool show(pcl::visualization::PCLVisualizer& viewer,
            const std::string& id,
            int viewport) const
  {
    viewer.removePolygonMesh(id, viewport);
    return triangles.empty() ||
           viewer.addPolygonMesh<pcl::PointXYZRGB>(vertices, triangles, id, viewport);
  }
};

/// Steps around the axis of a sphere; half as many along it.
constexpr int kEllipsoidSteps = 16;

/// Points centre + radii v over the unit sphere.
/// \param radii square root of a covariance, times sigmas
inline Mesh
ellipsoidMesh(const Eigen::Vector3d& centre, const Eigen::Matrix3d& radii)
{
  constexpr int n = kEllipsoidSteps, rings = n / 2;
  const double step = 2.0 * std::acos(-1.0) / n;
  Mesh mesh;
  for (int i = 0; i <= rings; ++i)
    for (int j = 0; j < n; ++j) {
      const double latitude = step * i, longitude = step * j;
      const Eigen::Vector3d v(std::sin(latitude) * std::cos(longitude),
                              std::sin(latitude) * std::sin(longitude),
                              std::cos(latitude));
      mesh.vertices.push_back(centre + radii * v);
    }
  for (int i = 0; i < rings; ++i)
    for (int j = 0; j < n; ++j) {
      const int a = i * n + j, b = i * n + (j + 1) % n;
      mesh.triangles.push_back({a, a + n, b});
      mesh.triangles.push_back({b, a + n, b + n});
    }
  return mesh;
}

} // namespace detail

/// Color of a kind of surface, red green blue.
inline std::array<std::uint8_t, 3>
viewerColor(SurfaceType surface)
{
  constexpr std::array<std::array<std::uint8_t, 3>, 7> kColors{{{140, 140, 140},
                                                                {230, 159, 0},
                                                                {86, 180, 233},
                                                                {0, 158, 115},
                                                                {240, 228, 66},
                                                                {0, 114, 178},
                                                                {204, 121, 167}}};
  return kColors.at(static_cast<std::size_t>(surface));
}

/// Adds the accepted patches to a viewer as one mesh, colored by their surface, in
/// place of a mesh of that id. Nothing is added where there is no patch.
/// \param spacing_m longest edge along the outlines.
/// \return false when the viewer would not take it.
/// \throw std::invalid_argument for a spacing that is not positive.
inline bool
addPatches(pcl::visualization::PCLVisualizer& viewer,
           const std::vector<ExtractedPatch>& patches,
           const std::string& id = "patches",
           double spacing_m = 0.01,
           int viewport = 0)
{
  detail::ViewerMesh mesh;
  for (const ExtractedPatch& patch : patches)
    if (isAccepted(patch))
      mesh.add(tessellate(patch.fit.patch, spacing_m),
               viewerColor(patch.fit.patch.type.surface));
  return mesh.show(viewer, id, viewport);
}

/// Adds the ellipsoids of the centres' covariances, of that many sigmas, as one mesh in
/// place of one of that id.
/// \param scale enlarges what would be too small to see.
/// \return false when the viewer would not take it.
inline bool
addEllipsoids(pcl::visualization::PCLVisualizer& viewer,
              const std::vector<ExtractedPatch>& patches,
              const std::string& id = "ellipsoids",
              double sigmas = 3.0,
              double scale = 1.0,
              int viewport = 0)
{
  detail::ViewerMesh mesh;
  for (const ExtractedPatch& patch : patches) {
    if (!isAccepted(patch))
      continue;
    const Eigen::Matrix3d Sigma = patch.fit.covariance.bottomRightCorner<3, 3>();
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(Sigma);
    const Eigen::Vector3d radii = eigen.eigenvalues().cwiseMax(0.0).cwiseSqrt();
    mesh.add(detail::ellipsoidMesh(patch.fit.patch.c,
                                   sigmas * scale * eigen.eigenvectors() *
                                       radii.asDiagonal()),
             viewerColor(patch.fit.patch.type.surface));
  }
  return mesh.show(viewer, id, viewport);
}

} // namespace holdfast
