/// \file What a camera measured where it sees a patch.
#pragma once

#include <holdfast/geometry/pose.h>
#include <holdfast/patch/patch.h>

#include <vector>

namespace holdfast {

/// Pixels of a camera with what they measured, to be compared with a patch in one pass.
class PatchRays {
public:
  void clear();

  /// \param x y slopes of the ray, x/z and y/z. \param inverse_depth measured, 1/m.
  void add(double x, double y, double inverse_depth);

  /// The share of the pixels that see the bounded patch and measured another 1/z, by
  /// more than `tolerance`, 1/m; zero where none sees it.
  double strayShare(const Patch& patch, const Pose& camera, double tolerance);

  /// 1/z at which each ray meets the bounded patch, 1/m; zero where it misses. Valid
  /// until the next call.
  const std::vector<double>& meet(const Patch& patch, const Pose& camera);

private:
  std::vector<double> x_, y_, measured_, met_;
};

} // namespace holdfast
