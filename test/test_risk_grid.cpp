// Layers of contact risk over a map, and its planar regions: that they say what single
// contacts say, where grid_map looks for it.
#include "support/random.h"
#include "support/risk_map.h"

#include <holdfast/contact/foothold.h>
#include <holdfast/contact/planar_region.h>
#include <holdfast/contact/risk_grid.h>
#include <holdfast/geometry/constants.h>

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

namespace holdfast { namespace {

using test::groundMeasurement;
using test::Random;
using test::roughGround;

constexpr double kRadius = 0.06;

Foot
smallFoot()
{
  return rectangularFoot(0.06, 0.04);
}

/// Level patches at these places, seen from 2 m above.
PatchMap
levelMap(const std::vector<Eigen::Vector3d>& places, double curvature = 0.0)
{
  PatchMap::Snapshot empty;
  empty.options.radius_m = kRadius;
  empty.pose.R = Eigen::Vector3d(1.0, -1.0, -1.0).asDiagonal();
  empty.pose.c.z() = 2.0;
  PatchMap map(empty);
  std::vector<Measurement> measurements;
  for (const Eigen::Vector3d& place : places) {
    Pose anchor;
    anchor.c = place;
    Measurement m = groundMeasurement(measurements.size() + 1,
                                      empty.pose.inverse() * anchor,
                                      kRadius);
    m.jet.value[3] = m.jet.value[5] = curvature;
    measurements.push_back(m);
  }
  map.update(measurements);
  return map;
}

TEST(RiskGrid, HasTheSemanticsOfGridMap)
{
  const PatchMap map = levelMap({{0.5, -0.3, 0.1}});
  RiskGridOptions options;
  options.resolution_m = 0.02;
  const RiskGrid grid = riskGrid(map, smallFoot(), options);
  ASSERT_EQ(grid.layers.size(), kRiskLayerNames.size());
  EXPECT_EQ(grid.layers[static_cast<int>(RiskLayer::YawBest)], "yaw_best");
  EXPECT_EQ(grid.basic_layers, std::vector<std::string>{"elevation"});
  EXPECT_NEAR(grid.info.length_x_m, 0.02 * grid.rows, 1e-12);
  EXPECT_NEAR(grid.info.length_y_m, 0.02 * grid.columns, 1e-12);
  EXPECT_TRUE(grid.info.axes.isIdentity(1e-12));
  for (const auto& layer : grid.data)
    EXPECT_EQ(layer.size(), static_cast<std::size_t>(grid.rows * grid.columns));
  // Rows run against x, columns against y, and the data column by column.
  EXPECT_GT(grid.position(0, 0).x(), grid.position(1, 0).x());
  EXPECT_GT(grid.position(0, 0).y(), grid.position(0, 1).y());
  EXPECT_EQ(grid.position(0, 0).y(), grid.position(1, 0).y());
  const Eigen::Vector2d first =
      grid.info.position.head<2>() +
      0.5 * Eigen::Vector2d(grid.info.length_x_m - 0.02, grid.info.length_y_m - 0.02);
  EXPECT_NEAR((grid.position(0, 0) - first).norm(), 0.0, 1e-12);
  int seen = 0;
  for (int row = 0; row < grid.rows; ++row)
    for (int column = 0; column < grid.columns; ++column) {
      const bool is_seen =
          (grid.position(row, column) - Eigen::Vector2d(0.5, -0.3)).norm() < 0.05;
      if (!is_seen)
        continue;
      ++seen;
      EXPECT_NEAR(grid.at(RiskLayer::Elevation, row, column), 0.1, 1e-6);
      EXPECT_NEAR(grid.at(RiskLayer::NormalZ, row, column), 1.0, 1e-6);
      EXPECT_NEAR(grid.point(row, column).z(), 0.1, 1e-6);
      EXPECT_GT(grid.at(RiskLayer::ElevationSigma, row, column), 0.0F);
    }
  EXPECT_GT(seen, 12);
}

TEST(RiskGrid, SaysWhatASingleContactSays)
{
  Random random;
  const PatchMap map = roughGround(4, kRadius, random);
  RiskGridOptions options;
  options.resolution_m = 0.015;
  options.yaws = 4;
  const RiskGrid grid = riskGrid(map, smallFoot(), options);
  int compared = 0, without = 0;
  for (int row = 0; row < grid.rows; ++row)
    for (int column = 0; column < grid.columns; ++column) {
      const float total = grid.at(RiskLayer::RiskTotal, row, column);
      without += std::isnan(total) ? 1 : 0;
      if (std::isnan(total))
        continue;
      // It is the contact of one of the patches there.
      Placement placement;
      placement.point = grid.point(row, column);
      double nearest = 1.0;
      for (const MapPatch& patch : map.patches()) {
        Placement best = placement;
        const ContactRisk risk = bestYaw(
            contactSurfaceOf(map, patch, surfacePriorOf(map, options.load_direction)),
            smallFoot(),
            best,
            options.yaws);
        if (risk.quality)
          nearest = std::min(nearest, std::abs(risk.quality->risk.total - total));
      }
      EXPECT_LT(nearest, 1e-3) << "row " << row << " column " << column;
      ++compared;
    }
  EXPECT_GT(compared, 50);
  EXPECT_GT(without, 50);
}

TEST(RiskGrid, IsNaNWhereNothingWasSeen)
{
  const PatchMap map = levelMap({{0.0, 0.0, 0.0}});
  RiskGridOptions options;
  options.bounds = GridBounds{{-0.3, -0.3}, {0.3, 0.3}};
  const RiskGrid grid = riskGrid(map, smallFoot(), options);
  EXPECT_EQ(grid.rows, 30);
  EXPECT_EQ(grid.columns, 30);
  for (int layer = 0; layer < 14; ++layer)
    EXPECT_TRUE(std::isnan(grid.data[static_cast<std::size_t>(layer)][0]));
  const int middle = 15;
  EXPECT_LT(grid.at(RiskLayer::RiskTotal, middle, middle), 0.2F);
  // At the edge of what was seen: a surface, and no risk but that of the support.
  int edge = 0;
  for (int row = 0; row < 30; ++row)
    if (const float z = grid.at(RiskLayer::Elevation, row, middle);
        !std::isnan(z) && std::isnan(grid.at(RiskLayer::RiskTotal, row, middle))) {
      EXPECT_GT(grid.at(RiskLayer::RiskSupport, row, middle), 0.1F);
      EXPECT_TRUE(std::isnan(grid.at(RiskLayer::ContactArea, row, middle)));
      ++edge;
    }
  EXPECT_GT(edge, 0);
}

TEST(RiskGrid, TakesTheUpperOfTwoStoreys)
{
  const PatchMap map = levelMap({{0.0, 0.0, 0.0}, {0.0, 0.0, 0.5}});
  ASSERT_EQ(map.patches().size(), 2u);
  const RiskGrid grid = riskGrid(map, smallFoot());
  float highest = -1.0F, lowest = 1.0F;
  for (const float z : grid.data[0])
    if (!std::isnan(z)) {
      highest = std::max(highest, z);
      lowest = std::min(lowest, z);
    }
  EXPECT_NEAR(highest, 0.5, 1e-6);
  EXPECT_NEAR(lowest, 0.5, 1e-6);
}

TEST(RiskGrid, TurnsWithTheLoad)
{
  // A wall that a hand pushes along y: the grid's z axis is against the push.
  Random random;
  const PatchMap ground = roughGround(3, kRadius, random);
  Pose wall;
  wall.R << 1.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 1.0, 0.0; // z becomes -y
  PatchMap::Snapshot turned = ground.snapshot();
  turned.pose = wall * turned.pose;
  for (MapPatch& patch : turned.patches)
    patch.anchor = wall * patch.anchor;
  RiskGridOptions options;
  const RiskGrid level = riskGrid(ground, smallFoot(), options);
  options.load_direction = {0.0, 1.0, 0.0};
  const RiskGrid upright = riskGrid(PatchMap(turned), smallFoot(), options);
  ASSERT_EQ(upright.rows, level.rows);
  ASSERT_EQ(upright.columns, level.columns);
  for (std::size_t layer = 0; layer < level.data.size() - 1; ++layer)
    for (std::size_t i = 0; i < level.data[layer].size(); ++i)
      if (!std::isnan(level.data[layer][i])) {
        EXPECT_NEAR(upright.data[layer][i], level.data[layer][i], 1e-4);
      }
  EXPECT_NEAR((upright.info.axes.col(2) + Eigen::Vector3d::UnitY()).norm(), 0, 1e-12);
}

TEST(RiskGrid, IsTheSameForAnyNumberOfThreads)
{
  Random random;
  const PatchMap map = roughGround(4, kRadius, random);
  RiskGridOptions options;
  options.resolution_m = 0.02;
  const RiskGrid one = riskGrid(map, smallFoot(), options);
  options.threads = 3;
  const RiskGrid three = riskGrid(map, smallFoot(), options);
  for (std::size_t layer = 0; layer < one.data.size(); ++layer)
    for (std::size_t i = 0; i < one.data[layer].size(); ++i) {
      const float a = one.data[layer][i], b = three.data[layer][i];
      EXPECT_TRUE(a == b || (std::isnan(a) && std::isnan(b)));
    }
}

TEST(RiskGrid, RefusesWhatMakesNoSense)
{
  const PatchMap map = levelMap({{0.0, 0.0, 0.0}});
  RiskGridOptions options;
  options.resolution_m = 0.0;
  EXPECT_THROW(riskGrid(map, smallFoot(), options), std::invalid_argument);
  options.resolution_m = 1e-6;
  EXPECT_THROW(riskGrid(map, smallFoot(), options), std::invalid_argument);
  options = RiskGridOptions();
  options.bounds = GridBounds{{0.0, 0.0}, {0.0, 1.0}};
  EXPECT_THROW(riskGrid(map, smallFoot(), options), std::invalid_argument);
  options = RiskGridOptions();
  options.load_direction.setZero();
  EXPECT_THROW(riskGrid(map, smallFoot(), options), std::invalid_argument);
  EXPECT_EQ(riskGrid(PatchMap(), smallFoot()).rows, 0);
}

TEST(PlanarRegions, AreThePatchesThatHardlyBend)
{
  // |k| r^2 / 2 is 0.9 and 5.4 mm.
  EXPECT_EQ(planarRegions(levelMap({{0.0, 0.0, 0.0}}, 0.5)).size(), 1u);
  EXPECT_EQ(planarRegions(levelMap({{0.0, 0.0, 0.0}}, -3.0)).size(), 0u);
}

TEST(PlanarRegions, AreConvexSeenAllOverAndInset)
{
  const PatchMap map = levelMap({{0.4, 0.2, 0.1}});
  const auto regions = planarRegions(map);
  ASSERT_EQ(regions.size(), 1u);
  const PlanarRegion& region = regions.front();
  EXPECT_NEAR((region.pose.c - Eigen::Vector3d(0.4, 0.2, 0.1)).norm(), 0.0, 1e-6);
  EXPECT_NEAR(region.pose.R(2, 2), 1.0, 1e-9);
  ASSERT_EQ(region.insets.size(), 1u);
  const PlanarOutline& outer = region.boundary.outer;
  const PlanarOutline& inner = region.insets.front().outer;
  ASSERT_EQ(outer.size(), inner.size());
  for (std::size_t i = 0; i < outer.size(); ++i) {
    const Eigen::Vector2d &a = outer[i], &b = outer[(i + 1) % outer.size()],
                          &c = outer[(i + 2) % outer.size()];
    const Eigen::Vector2d ab = b - a, bc = c - b;
    EXPECT_GT(ab.x() * bc.y() - ab.y() * bc.x(), 0.0); // convex, to the left
    EXPECT_LT(inner[i].norm(), a.norm());
    EXPECT_TRUE((a.array() >= region.low.array() - 1e-12).all());
    EXPECT_TRUE((a.array() <= region.high.array() + 1e-12).all());
    const Eigen::Vector3d p =
        map.patches()[0].anchor.toLocal(region.pose.toWorld({a.x(), a.y(), 0.0}));
    EXPECT_TRUE(map.patches()[0].support.contains(p.x() / kRadius, p.y() / kRadius));
  }
}

TEST(PlanarRegions, KeepClearOfWhatWasNotSeen)
{
  PatchMap::Snapshot snapshot = levelMap({{0.0, 0.0, 0.0}}).snapshot();
  // A hole in the middle leaves nothing; a bite from one side makes it smaller.
  auto rows = snapshot.patches[0].support.rows();
  const auto whole = rows;
  rows[8] = rows[7] = 0;
  snapshot.patches[0].support = SupportGrid::fromRows(rows);
  EXPECT_TRUE(planarRegions(PatchMap(snapshot)).empty());
  rows = whole;
  for (auto& row : rows)
    row = static_cast<std::uint16_t>(row & 0x07FFU);
  snapshot.patches[0].support = SupportGrid::fromRows(rows);
  const auto bitten = planarRegions(PatchMap(snapshot));
  const auto all = planarRegions(levelMap({{0.0, 0.0, 0.0}}));
  ASSERT_EQ(bitten.size(), 1u);
  EXPECT_LT(bitten[0].high.x(), all[0].high.x());
}

TEST(PlanarRegions, RefuseWhatMakesNoSense)
{
  PlanarRegionOptions options;
  options.max_sagitta_m = 0.0;
  EXPECT_THROW(planarRegions(PatchMap(), options), std::invalid_argument);
  options = PlanarRegionOptions();
  options.corners = 2;
  EXPECT_THROW(planarRegions(PatchMap(), options), std::invalid_argument);
}

}} // namespace holdfast
