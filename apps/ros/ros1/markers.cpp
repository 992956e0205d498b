#include "ros1/markers.h"

#include "ros1/conversions.h"

#include <holdfast/io/patch_io.h>
#include <holdfast/patch/boundary.h>
#include <holdfast/patch/tessellation.h>

#include <Eigen/Eigenvalues>

#include <algorithm>

namespace holdfast::robot {
namespace {

using visualization_msgs::Marker;

/// Of outline and mesh: a quarter of the longest half.
double
spacingOf(const Patch& patch)
{
  return 0.25 * patch.d.head<4>().maxCoeff(); // the fifth is an angle
}

std_msgs::ColorRGBA
colorOf(const AnswerPatch& answered)
{
  const auto rgb = surfaceColor(answered.patch.fit.patch.type.surface);
  std_msgs::ColorRGBA color;
  color.r = static_cast<float>(rgb[0]) / 255.0F;
  color.g = static_cast<float>(rgb[1]) / 255.0F;
  color.b = static_cast<float>(rgb[2]) / 255.0F;
  color.a = answered.is_seen_now ? 0.9F : 0.4F;
  return color;
}

Marker
emptyMarker(const Header& header, const char* name, int type)
{
  Marker marker;
  marker.header = toMessage(header);
  marker.ns = name;
  marker.type = type;
  marker.action = Marker::ADD;
  marker.pose.orientation.w = 1.0;
  marker.scale.x = marker.scale.y = marker.scale.z = 1.0;
  return marker;
}

void
addTriangles(const AnswerPatch& answered, Marker& marker)
{
  const Patch& patch = answered.patch.fit.patch;
  const Mesh mesh = tessellate(patch, spacingOf(patch));
  const std_msgs::ColorRGBA color = colorOf(answered);
  for (const std::array<int, 3>& triangle : mesh.triangles)
    for (const int corner : triangle) {
      marker.points.push_back(toPoint(mesh.vertices[static_cast<std::size_t>(corner)]));
      marker.colors.push_back(color);
    }
}

Marker
ellipsoid(const AnswerPatch& answered, const Header& header, double factor)
{
  const FitResult& fit = answered.patch.fit;
  const Eigen::Matrix3d Sigma = fit.covariance.bottomRightCorner<3, 3>();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(Sigma);
  Eigen::Matrix3d axes = eigen.eigenvectors();
  if (axes.determinant() < 0.0)
    axes.col(0) *= -1.0;
  // A scale of zero is a mistake to rviz.
  constexpr double kThinnest = 1e-6; // m
  const Eigen::Vector3d diameters =
      2.0 * factor * eigen.eigenvalues().cwiseMax(0.0).cwiseSqrt();
  Marker marker = emptyMarker(header, "ellipsoids", Marker::SPHERE);
  marker.pose = toMessage(Pose{axes, fit.patch.c});
  marker.scale.x = std::max(kThinnest, diameters.x());
  marker.scale.y = std::max(kThinnest, diameters.y());
  marker.scale.z = std::max(kThinnest, diameters.z());
  marker.color = colorOf(answered);
  return marker;
}

} // namespace

std::vector<Eigen::Vector3d>
outlineOnSurface(const Patch& patch)
{
  const double spacing = spacingOf(patch);
  std::vector<Eigen::Vector3d> vertices = tessellate(patch, spacing).vertices;
  vertices.resize(std::min(vertices.size(), outline(patch, spacing).size()));
  return vertices;
}

visualization_msgs::MarkerArray
toMarkers(const Answer& answer, const MarkerOptions& options)
{
  visualization_msgs::MarkerArray array;
  Marker all;
  all.header = toMessage(answer.header);
  all.action = Marker::DELETEALL;
  array.markers.push_back(all);
  Marker mesh = emptyMarker(answer.header, "patches", Marker::TRIANGLE_LIST);
  for (const AnswerPatch& answered : answer.patches)
    addTriangles(answered, mesh);
  if (!mesh.points.empty())
    array.markers.push_back(std::move(mesh));
  for (const AnswerPatch& answered : answer.patches) {
    array.markers.push_back(
        ellipsoid(answered, answer.header, options.sigmas * options.scale));
    array.markers.back().id = static_cast<int>(array.markers.size());
  }
  return array;
}

} // namespace holdfast::robot
