/// \file The nearest points of a cloud.
///
/// In place of PCL's tree (FLANN), so that clouds and their neighbourhoods need PCL's
/// headers alone, none of its libraries; and where distances are equal the answer is a
/// definite one.
#pragma once

#include "path_search.h"

#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace holdfast {

/// A k-d tree: each point of an inner node splits those around it in two halves.
class NearestPoints {
public:
  /// Without points, which has none to find.
  NearestPoints() = default;

  /// \param valid indices of the points to find, all of them finite.
  NearestPoints(const pcl::PointCloud<pcl::PointXYZ>& points,
                const std::vector<int>& valid);

  /// The k points nearest to a finite centre, or all if there are fewer, in no order;
  /// of points equally far, in single precision, those with the smaller indices. \param
  /// heap working memory.
  void search(const pcl::PointXYZ& centre,
              std::size_t k,
              std::vector<PathEnd>& heap,
              std::vector<int>& indices) const;

private:
  struct Entry {
    float q[3];
    int index;
  };
  struct Query;

  void split(std::size_t begin, std::size_t end);
  void visit(std::size_t begin, std::size_t end, Query& query) const;

  std::vector<Entry> entries_; ///< those of a half follow each other
  std::vector<std::uint8_t> axes_; ///< that a node's point splits along
};

} // namespace holdfast
