#include <holdfast/patch/boundary.h>
#include <holdfast/patch/surface.h>
#include <holdfast/patch/tessellation.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

namespace holdfast {
namespace {

// One ring of the mesh: the boundary scaled towards the centre, its vertices in
// counter-clockwise order.
struct Ring {
  std::array<int, 4> segments{}; // edges per side of the boundary
  std::array<int, 4> first{}; // vertex at the start of each side
};

// The patch with a boundary that ends where a sphere or cylinder reaches its equator.
Patch
withinEquator(Patch patch)
{
  if (!traitsOf(patch.type.surface).is_round)
    return patch;
  // Across the axis: the circle's radius, the rectangle's second half length.
  double& across = patch.d(boundaryParameterCount(patch.type.boundary) - 1);
  across = std::min(across, 1.0 / std::abs(patch.kappa.x()));
  return patch;
}

class Tessellator {
public:
  Tessellator(const Patch& patch, double spacing)
  : patch_(withinEquator(patch))
  , pose_(patch_.pose())
  , outer_segments_(outlineSegments(patch_, spacing))
  {
    double longest = 0.0;
    for (int s = 0; s < 4; ++s)
      longest = std::max(longest, boundaryPoint(patch_, s).norm());
    ring_count_ = std::max(1, static_cast<int>(std::ceil(longest / spacing)));
  }

  Mesh run()
  {
    Ring outer = addRing(ring_count_);
    for (int level = ring_count_ - 1; level > 0; --level) {
      const Ring inner = addRing(level);
      for (std::size_t side = 0; side < 4; ++side)
        addStrip(outer, inner, side);
      outer = inner;
    }
    addFan(outer);
    return std::move(mesh_);
  }

private:
  int addVertex(const Eigen::Vector2d& xy)
  {
    const double z = height(patch_, xy.x(), xy.y()).value();
    mesh_.vertices.push_back(pose_.toWorld({xy.x(), xy.y(), z}));
    return static_cast<int>(mesh_.vertices.size()) - 1;
  }

  // Rings closer to the centre get proportionally fewer vertices, but keep the corners:
  // sides stay parallel to those outside, so no triangle between them can fold over.
  Ring addRing(int level)
  {
    const double scale = static_cast<double>(level) / ring_count_;
    Ring ring;
    for (std::size_t s = 0; s < 4; ++s) {
      const int segments = static_cast<int>(std::ceil(scale * outer_segments_[s]));
      ring.segments[s] = segments;
      ring.first[s] = static_cast<int>(mesh_.vertices.size());
      for (int i = 0; i < segments; ++i) {
        const double u = static_cast<double>(s) + static_cast<double>(i) / segments;
        addVertex(scale * boundaryPoint(patch_, u));
      }
    }
    return ring;
  }

  // Vertex i of a side; the one after its last edge starts the next side.
  static int vertexOf(const Ring& ring, std::size_t side, int i)
  {
    return i < ring.segments[side] ? ring.first[side] + i : ring.first[(side + 1) % 4];
  }

  // Triangles between two rings along one side: whichever ring has its next vertex
  // earlier along the side advances, so the two fronts stay abreast.
  void addStrip(const Ring& outer, const Ring& inner, std::size_t side)
  {
    const int n_outer = outer.segments[side];
    const int n_inner = inner.segments[side];
    int i = 0;
    int j = 0;
    while (i < n_outer || j < n_inner) {
      const int at_outer = vertexOf(outer, side, i);
      const int at_inner = vertexOf(inner, side, j);
      // (i + 1) / n_outer <= (j + 1) / n_inner without rounding.
      const auto outer_next = static_cast<std::int64_t>(i + 1) * n_inner;
      const auto inner_next = static_cast<std::int64_t>(j + 1) * n_outer;
      if (outer_next <= inner_next)
        mesh_.triangles.push_back({at_outer, vertexOf(outer, side, ++i), at_inner});
      else
        mesh_.triangles.push_back({at_outer, vertexOf(inner, side, ++j), at_inner});
    }
  }

  // Triangles between the innermost ring and the centre.
  void addFan(const Ring& ring)
  {
    const int centre = addVertex(Eigen::Vector2d::Zero());
    for (std::size_t side = 0; side < 4; ++side)
      for (int i = 0; i < ring.segments[side]; ++i)
        mesh_.triangles.push_back(
            {vertexOf(ring, side, i), vertexOf(ring, side, i + 1), centre});
  }

  Patch patch_;
  Pose pose_;
  std::array<int, 4> outer_segments_;
  int ring_count_ = 1;
  Mesh mesh_;
};

} // namespace

Mesh
tessellate(const Patch& patch, double spacing)
{
  return Tessellator(patch, spacing).run();
}

} // namespace holdfast
