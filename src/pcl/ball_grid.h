/// \file Points of unorganized clouds within a distance.
///
/// In place of a k-d tree, since the radius is known beforehand. Measured with ten
/// million points: PCL's tree (FLANN) takes three times the memory of the points
/// themselves, four times as long to build and twice as long to ask
/// (holdfast_scale_benchmark, balls); nanoflann's takes half the memory of this grid,
/// and longer than FLANN's to ask.
#pragma once

#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <cstdint>
#include <unordered_map>
#include <vector>

namespace holdfast {

/// Points in cubes, row after row of cubes along x, so that those of neighbouring cubes
/// of a row follow each other in memory.
class BallGrid {
public:
  /// \param valid indices of the points to find, ascending, all of them finite.
  /// \param edge_m of the cubes: the radius that is mostly asked for.
  BallGrid(const pcl::PointCloud<pcl::PointXYZ>& points,
           const std::vector<int>& valid,
           double edge_m);

  /// The points nearer to a finite centre than the radius, m, ascending; in single
  /// precision, as FLANN has them.
  void search(const pcl::PointXYZ& centre,
              double radius,
              std::vector<int>& indices) const;

private:
  struct Entry {
    float x, y, z;
    int index;
  };
  /// Cubes side by side along x that hold points: from `begin` on, to that of the next.
  struct Cube {
    std::int32_t x;
    std::uint32_t begin;
  };
  /// Those of one row.
  struct Row {
    std::uint32_t begin = 0, end = 0;
  };

  std::int32_t cubeOf(double coordinate) const;
  static std::uint64_t rowKey(std::int32_t y, std::int32_t z);
  void sortIntoRows(const pcl::PointCloud<pcl::PointXYZ>& points,
                    const std::vector<int>& valid);
  void cutRows();
  void searchRow(const Row& row,
                 const pcl::PointXYZ& centre,
                 double radius,
                 std::vector<int>& indices) const;

  double cubes_per_m_;
  std::vector<Entry> entries_;
  std::vector<Cube> cubes_; ///< and one behind the last
  std::unordered_map<std::uint64_t, Row> rows_;
};

} // namespace holdfast
