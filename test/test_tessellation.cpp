#include "support/random_patch.h"

#include <holdfast/patch/boundary.h>
#include <holdfast/patch/surface.h>
#include <holdfast/patch/tessellation.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <utility>

namespace holdfast { namespace {

using test::Random;
using test::randomPatch;

constexpr double kRounding = 1e-13;

// From a tenth of the smallest patch to beyond the largest.
constexpr std::array<double, 6> kSpacings{0.004, 0.011, 0.03, 0.07, 0.2, 10.0};

class Tessellation : public testing::TestWithParam<PatchType> {};

// How often each directed edge occurs.
std::map<std::pair<int, int>, int>
directedEdges(const Mesh& mesh)
{
  std::map<std::pair<int, int>, int> edges;
  for (const auto& triangle : mesh.triangles)
    for (std::size_t k = 0; k < 3; ++k)
      ++edges[{triangle[k], triangle[(k + 1) % 3]}];
  return edges;
}

Eigen::Vector2d
localXy(const Patch& patch, const Eigen::Vector3d& world)
{
  return patch.pose().toLocal(world).head<2>();
}

double
localArea(const Patch& patch, const Mesh& mesh, const std::array<int, 3>& triangle)
{
  std::array<Eigen::Vector2d, 3> p;
  for (std::size_t k = 0; k < 3; ++k)
    p[k] = localXy(patch, mesh.vertices[static_cast<std::size_t>(triangle[k])]);
  const Eigen::Vector2d a = p[1] - p[0];
  const Eigen::Vector2d b = p[2] - p[0];
  return 0.5 * (a.x() * b.y() - a.y() * b.x());
}

// Properties that make it a disc-like mesh with the first `rim` vertices as boundary.
void
expectWatertight(const Mesh& mesh, int rim)
{
  const auto edges = directedEdges(mesh);
  int open = 0;
  for (const auto& [edge, count] : edges) {
    EXPECT_EQ(count, 1) << "two triangles run along an edge the same way";
    if (edges.count({edge.second, edge.first}) != 0)
      continue;
    ++open;
    EXPECT_EQ((edge.first + 1) % rim, edge.second) << "a gap, or a rim out of order";
  }
  EXPECT_EQ(open, rim);
  // Euler characteristic of a disc, V - E + F = 1, with each closed edge counted twice.
  const auto undirected = (static_cast<int>(edges.size()) + open) / 2;
  EXPECT_EQ(static_cast<int>(mesh.vertices.size() + mesh.triangles.size()) - undirected,
            1);
}

void
expectSound(const Patch& patch, double spacing)
{
  const Mesh mesh = tessellate(patch, spacing);
  const auto rim = outline(patch, spacing);
  expectWatertight(mesh, static_cast<int>(rim.size()));

  ASSERT_GE(mesh.vertices.size(), rim.size());
  for (std::size_t i = 0; i < rim.size(); ++i)
    EXPECT_LT((localXy(patch, mesh.vertices[i]) - rim[i]).norm(), kRounding);

  std::set<int> used;
  double area = 0.0;
  for (const auto& triangle : mesh.triangles) {
    used.insert(triangle.begin(), triangle.end());
    const double part = localArea(patch, mesh, triangle);
    EXPECT_GT(part, 0.0) << "degenerate, folded or clockwise";
    area += part;
  }
  EXPECT_EQ(used.size(), mesh.vertices.size());
  // Triangles that cover the outline's area and none of which is turned over cannot
  // overlap.
  double expected = 0.0;
  for (std::size_t i = 0; i < rim.size(); ++i) {
    const Eigen::Vector2d& b = rim[(i + 1) % rim.size()];
    expected += 0.5 * (rim[i].x() * b.y() - rim[i].y() * b.x());
  }
  EXPECT_NEAR(area, expected, kRounding);
}

TEST_P(Tessellation, IsWatertightAndFreeOfDegenerateTriangles)
{
  for (std::size_t i = 0; i < kSpacings.size(); ++i) {
    for (std::uint64_t k = 0; k < 4; ++k) {
      Random random(10 * i + k);
      expectSound(randomPatch(random, GetParam()), kSpacings[i]);
    }
  }
}

TEST_P(Tessellation, LongPatchesAreSound)
{
  for (const double ratio : {0.02, 0.2, 5.0, 50.0}) {
    Random random;
    Patch patch = randomPatch(random, GetParam());
    patch.d(0) = 0.02 * std::sqrt(ratio);
    if (boundaryParameterCount(GetParam().boundary) > 1)
      patch.d(1) = 0.02 / std::sqrt(ratio);
    for (const double spacing : {0.002, 0.01, 0.05})
      expectSound(patch, spacing);
  }
}

TEST_P(Tessellation, VerticesLieOnTheSurfaceWithinTheBoundary)
{
  Random random;
  const Patch patch = randomPatch(random, GetParam());
  for (const Eigen::Vector3d& vertex : tessellate(patch, 0.01).vertices) {
    EXPECT_NEAR(implicitValue(patch, vertex), 0.0, kRounding);
    EXPECT_TRUE(contains(patch, (1.0 - 1e-12) * localXy(patch, vertex)));
  }
}

TEST_P(Tessellation, TrianglesFaceTheNormal)
{
  Random random;
  const Patch patch = randomPatch(random, GetParam());
  const Mesh mesh = tessellate(patch, 0.01);
  for (const auto& t : mesh.triangles) {
    const Eigen::Vector3d& a = mesh.vertices[static_cast<std::size_t>(t[0])];
    const Eigen::Vector3d& b = mesh.vertices[static_cast<std::size_t>(t[1])];
    const Eigen::Vector3d& c = mesh.vertices[static_cast<std::size_t>(t[2])];
    EXPECT_GT((b - a).cross(c - a).dot(patch.normal()), 0.0);
  }
}

TEST_P(Tessellation, EdgesAreAtMostTwiceTheSpacing)
{
  for (const double spacing : {0.005, 0.02}) {
    Random random;
    const Patch patch = randomPatch(random, GetParam());
    const Mesh mesh = tessellate(patch, spacing);
    double longest = 0.0;
    for (const auto& [edge, count] : directedEdges(mesh)) {
      const Eigen::Vector3d& a = mesh.vertices[static_cast<std::size_t>(edge.first)];
      const Eigen::Vector3d& b = mesh.vertices[static_cast<std::size_t>(edge.second)];
      longest = std::max(longest, (localXy(patch, a) - localXy(patch, b)).norm());
    }
    // Between rings an edge spans at most their distance and one edge along them.
    EXPECT_LT(longest, 2.0 * spacing);
    EXPECT_GT(longest, 0.5 * spacing);
  }
}

TEST_P(Tessellation, SpacingThatIsNotPositiveIsMisuse)
{
  Random random;
  const Patch patch = randomPatch(random, GetParam());
  for (const double bad : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()})
    EXPECT_THROW(tessellate(patch, bad), std::invalid_argument);
}

INSTANTIATE_TEST_SUITE_P(AllTypes,
                         Tessellation,
                         testing::ValuesIn(kPatchTypes),
                         test::patchTypeName);

TEST(TessellationBeyondTheEquator, EndsThere)
{
  for (const PatchType type :
       {PatchType{SurfaceType::Sphere, BoundaryType::Circle},
        PatchType{SurfaceType::CircularCylinder, BoundaryType::Rectangle}}) {
    for (const double kappa : {-7.0, 7.0}) {
      Random random;
      Patch patch = randomPatch(random, type);
      patch.kappa.x() = kappa;
      const int across = type.surface == SurfaceType::Sphere ? 0 : 1;
      patch.d(across) = 1.0 / std::abs(kappa);
      const Mesh to_equator = tessellate(patch, 0.02);
      expectSound(patch, 0.02);
      patch.d(across) = 0.3;
      const Mesh beyond = tessellate(patch, 0.02);
      EXPECT_EQ(beyond.vertices, to_equator.vertices);
      EXPECT_EQ(beyond.triangles, to_equator.triangles);
    }
  }
}

}} // namespace holdfast
