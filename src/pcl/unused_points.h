/// \file Keeps account of the points of a cloud that cannot be used.
#pragma once

#include <holdfast/pcl/point_accounting.h>
#include <holdfast/pcl/range_cloud.h>

#include <vector>

namespace holdfast {

/// Never where one is NaN.
bool isSamePlace(const pcl::PointXYZ& a, const pcl::PointXYZ& b);

/// Refers to the cloud.
class UnusedPoints {
public:
  explicit UnusedPoints(const RangeCloud& cloud);

  /// Leaves point i out for a reason, unless it is invalid or out already.
  void drop(std::size_t i, int PointAccounting::*reason);

  /// Leaves out what lies exactly where an earlier point does.
  void dropDuplicates();

  PointAccounting accounting() const;

  /// The cloud with unused points made NaN; a shallow copy where there are none.
  RangeCloud usedCloud() const;

private:
  const RangeCloud& cloud_;
  std::vector<bool> out_; ///< empty while nothing is left out
  PointAccounting points_;
};

} // namespace holdfast
