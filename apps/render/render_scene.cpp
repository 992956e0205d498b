#include "render_scene.h"

#include "parallel/parallel_for.h"
#include <holdfast/patch/boundary.h>
#include <holdfast/patch/surface.h>
#include <holdfast/patch/tessellation.h>

#include <Eigen/Geometry>
#include <Eigen/LU>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>

namespace holdfast::app {
namespace {

constexpr Rgb kStone{214, 209, 200}; // of points without colour
constexpr double kOutlineWidth = 1.6; // px
// Of lines on a sheet, so that it does not hide them; of the half-length.
constexpr double kLineStandOff = 0.01;

/// The largest half-length; gamma, the last of the five, is an angle.
double
halfLength(const Patch& patch)
{
  return patch.d.head<4>().maxCoeff();
}

/// Radius at which discs evenly spread over their bounding box would leave no gap, px;
/// not so large that single points look like things.
double
discRadius(const std::vector<ScreenPoint>& centers)
{
  Eigen::AlignedBox2d box;
  for (const ScreenPoint& center : centers)
    box.extend(Eigen::Vector2d(center.x, center.y));
  const double area = box.volume() / static_cast<double>(centers.size());
  return std::clamp(1.1 * std::sqrt(area), 0.7, 5.0);
}

/// A disc faces the eye, so on a slanted surface half of it stands out, by up to its
/// radius: it is moved back by as much.
ScreenPoint
movedBack(const View& view, const ScreenPoint& center, double radius)
{
  const double depth = view.depth(center.nearness);
  return {center.x, center.y, view.nearness(depth + radius * view.pixelSize(depth))};
}

/// What the points of a frame cover, row by row.
struct SurfaceMap {
  struct Pixel {
    double nearness;
    double depth; ///< m; not finite where nothing is
  };

  SurfaceMap(const Canvas& canvas, const View& view, const Frame& of) : frame(of)
  {
    for (int row = frame.top; row < frame.bottom; ++row)
      for (int column = frame.left; column < frame.right; ++column) {
        const double nearness = canvas.nearness(column, row);
        const double nothing = std::numeric_limits<double>::infinity();
        pixels.push_back(
            {nearness, std::isfinite(nearness) ? view.depth(nearness) : nothing});
      }
  }

  const Pixel& at(int column, int row) const
  {
    return pixels[static_cast<std::size_t>(row - frame.top) *
                      static_cast<std::size_t>(frame.width()) +
                  static_cast<std::size_t>(column - frame.left)];
  }

  Frame frame;
  std::vector<Pixel> pixels;
};

/// The surface in a pixel, linear in nearness.
struct LocalPlane {
  double nearness; ///< in the middle of the pixel
  double per_x; ///< px, to the right
  double per_y; ///< px, down
};

/// Least squares over the pixels about one that something covers. Those so much nearer
/// or farther that they must show another surface do not count.
LocalPlane
planeAbout(const SurfaceMap& map, const View& view, int column, int row)
{
  constexpr int kReach = 9; // px
  constexpr double kSteepest = 4.0; // slope of a surface
  const SurfaceMap::Pixel here = map.at(column, row);
  const double jump = kSteepest * kReach * view.pixelSize(here.depth);
  const int left = std::max(column - kReach, map.frame.left);
  const int right = std::min(column + kReach + 1, map.frame.right);
  const int top = std::max(row - kReach, map.frame.top);
  const int bottom = std::min(row + kReach + 1, map.frame.bottom);
  // A single pixel is taken as facing the eye.
  Eigen::Matrix3d A = 1e-6 * Eigen::Matrix3d::Identity();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  for (int v = top; v < bottom; ++v)
    for (int u = left; u < right; ++u) {
      const SurfaceMap::Pixel& pixel = map.at(u, v);
      if (!(std::abs(pixel.depth - here.depth) <= jump))
        continue;
      const Eigen::Vector3d terms(u - column, v - row, 1.0);
      A += terms * terms.transpose();
      b += (pixel.nearness - here.nearness) * terms;
    }
  const Eigen::Vector3d plane = A.inverse() * b;
  return {here.nearness + plane.z(), plane.x(), plane.y()};
}

/// Takes the noise out of the points' depth, and shades those without colour.
void
finishSurface(Canvas& canvas, const View& view, const Frame& frame, bool shade)
{
  const SurfaceMap map(canvas, view, frame);
  const auto finishRow = [&](int row) {
    for (int column = frame.left; column < frame.right; ++column) {
      if (!std::isfinite(map.at(column, row).depth))
        continue;
      const LocalPlane plane = planeAbout(map, view, column, row);
      const Eigen::Vector3d normal =
          view.normal({column + 0.5, row + 0.5, plane.nearness},
                      plane.per_x,
                      plane.per_y);
      canvas.finish(column, row, shade ? view.brightness(normal) : 1.0, plane.nearness);
    }
  };
  parallelFor(frame.height(), 0, [&](int i, int) { finishRow(frame.top + i); });
}

/// A mesh's vertices on the canvas, moved towards the eye; nothing when one of them
/// cannot be seen.
std::optional<std::vector<ScreenPoint>>
projectAll(const View& view,
           const std::vector<Eigen::Vector3d>& vertices,
           double closer)
{
  std::vector<ScreenPoint> points;
  for (const Eigen::Vector3d& vertex : vertices) {
    const auto point = view.project(vertex + closer * view.towardsEye(vertex));
    if (!point)
      return std::nullopt;
    points.push_back(*point);
  }
  return points;
}

/// How the triangles of a mesh are drawn.
struct MeshPaint {
  Rgb color;
  double opacity = 1.0;
  std::function<bool(const Eigen::Vector3d&)> is_drawn = {}; ///< by its middle
};

void
drawMesh(Canvas& canvas,
         const View& view,
         const Mesh& mesh,
         const std::vector<ScreenPoint>& points,
         const MeshPaint& paint)
{
  for (const std::array<int, 3>& triangle : mesh.triangles) {
    std::array<Eigen::Vector3d, 3> corners;
    std::array<ScreenPoint, 3> on_canvas;
    for (std::size_t i = 0; i < 3; ++i) {
      corners[i] = mesh.vertices[static_cast<std::size_t>(triangle[i])];
      on_canvas[i] = points[static_cast<std::size_t>(triangle[i])];
    }
    if (paint.is_drawn && !paint.is_drawn((corners[0] + corners[1] + corners[2]) / 3.0))
      continue;
    const Eigen::Vector3d normal =
        (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalized();
    canvas.drawTriangle(on_canvas,
                        scaled(paint.color, 0.55 + 0.5 * view.brightness(normal)),
                        paint.opacity);
  }
}

/// Lines along the first `count` points and back to the first: the vertices of a mesh
/// start with its outline.
void
drawOutline(Canvas& canvas,
            const std::vector<ScreenPoint>& points,
            std::size_t count,
            const Rgb& color)
{
  for (std::size_t i = 0; i < count; ++i)
    canvas.drawLine(points[i], points[(i + 1) % count], kOutlineWidth, color);
}

/// How many vertices the outline of a mesh of that spacing has.
std::size_t
outlineLength(const Patch& patch, double spacing)
{
  const std::array<int, 4> segments = outlineSegments(patch, spacing);
  return static_cast<std::size_t>(std::accumulate(segments.begin(), segments.end(), 0));
}

void
drawSegment(Canvas& canvas,
            const View& view,
            const Eigen::Vector3d& from,
            const Eigen::Vector3d& to,
            double width,
            const Rgb& color)
{
  const auto a = view.project(from), b = view.project(to);
  if (a && b)
    canvas.drawLine(*a, *b, width, color);
}

/// The point of the patch over the local (x, y); nothing outside its boundary.
std::optional<Eigen::Vector3d>
pointOn(const Patch& patch, const Eigen::Vector2d& xy)
{
  const auto z = height(patch, xy.x(), xy.y());
  if (!z || !contains(patch, xy))
    return std::nullopt;
  return patch.pose().toWorld({xy.x(), xy.y(), *z});
}

/// Lines of constant x (axis 0) or y (axis 1), a fifth of the half-length apart.
void
drawGridLines(Canvas& canvas,
              const View& view,
              const Patch& patch,
              Eigen::Index axis,
              const Rgb& color)
{
  constexpr int kLines = 5, kSteps = 100;
  const double length = halfLength(patch);
  for (int line = -kLines; line <= kLines; ++line) {
    std::optional<Eigen::Vector3d> last;
    for (int step = -kSteps; step <= kSteps; ++step) {
      Eigen::Vector2d xy = Eigen::Vector2d::Constant(length * line / kLines);
      xy(1 - axis) = length * step / kSteps;
      auto next = pointOn(patch, xy);
      if (next)
        *next += kLineStandOff * length * view.towardsEye(*next);
      if (last && next)
        drawSegment(canvas, view, *last, *next, 0.7, color);
      last = next;
    }
  }
}

/// The local frame: x red, y green, z blue.
void
drawAxes(Canvas& canvas, const View& view, const Patch& patch)
{
  constexpr std::array<Rgb, 3> kColors{{{200, 30, 30}, {20, 140, 40}, {30, 60, 200}}};
  const double length = halfLength(patch);
  const Pose pose = patch.pose();
  const Eigen::Vector3d origin =
      pose.c + 3.0 * kLineStandOff * length * view.towardsEye(pose.c);
  for (std::size_t i = 0; i < kColors.size(); ++i) {
    const Eigen::Vector3d axis = pose.R.col(static_cast<Eigen::Index>(i));
    drawSegment(canvas, view, origin, origin + 0.45 * length * axis, 2.2, kColors[i]);
  }
}

} // namespace

void
drawPoints(Canvas& canvas,
           const View& view,
           const Frame& frame,
           const PicturePoints& points)
{
  std::vector<ScreenPoint> centers;
  std::vector<Rgb> colors;
  for (std::size_t i = 0; i < points.positions.size(); ++i)
    if (const auto at = view.project(points.positions[i])) {
      centers.push_back(*at);
      colors.push_back(points.colors.empty() ? kStone : points.colors[i]);
    }
  if (centers.empty())
    return;
  const double radius = discRadius(centers);
  for (std::size_t i = 0; i < centers.size(); ++i)
    canvas.drawDisc(movedBack(view, centers[i], radius), radius, colors[i]);
  finishSurface(canvas, view, frame, points.colors.empty());
}

void
drawPatch(Canvas& canvas,
          const View& view,
          const Patch& patch,
          const SupportedCells& support,
          const Rgb& color,
          PatchEdge edge)
{
  constexpr double kStandOff = 0.25; // of the half-length
  constexpr double kOpacity = 0.7;
  const double spacing = halfLength(patch) / 8.0;
  const Mesh mesh = tessellate(patch, spacing);
  const auto points = projectAll(view, mesh.vertices, kStandOff * halfLength(patch));
  if (!points)
    return;
  const Pose pose = patch.pose();
  const auto isSupported = [&](const Eigen::Vector3d& p) {
    return support.contains(pose.toLocal(p).head<2>());
  };
  drawMesh(canvas, view, mesh, *points, {color, kOpacity, isSupported});
  if (edge == PatchEdge::Line)
    drawOutline(canvas, *points, outlineLength(patch, spacing), scaled(color, 0.6));
}

void
drawSolidPatch(Canvas& canvas, const View& view, const Patch& patch, const Rgb& color)
{
  const double spacing = halfLength(patch) / 40.0;
  const Mesh mesh = tessellate(patch, spacing);
  const auto sheet = projectAll(view, mesh.vertices, 0.0);
  const auto edge = projectAll(view, mesh.vertices, kLineStandOff * halfLength(patch));
  if (!sheet || !edge)
    return;
  drawMesh(canvas, view, mesh, *sheet, {color});
  for (const Eigen::Index axis : {0, 1})
    drawGridLines(canvas, view, patch, axis, scaled(color, 0.75));
  drawOutline(canvas, *edge, outlineLength(patch, spacing), scaled(color, 0.5));
  drawAxes(canvas, view, patch);
}

} // namespace holdfast::app
