/// \file What a camera measured where it sees a patch.
#pragma once

#include <holdfast/geometry/pose.h>
#include <holdfast/patch/patch.h>

#include <cstddef>
#include <vector>

namespace holdfast {

/// Pixels of a camera with what they measured, to be compared with a patch in one pass.
class PatchRays {
public:
  void clear()
  {
    count_ = 0;
  }

  /// \param x y slopes of the ray, x/z and y/z. \param inverse_depth measured, 1/m.
  void add(double x, double y, double inverse_depth);

  /// Rays of one row of an image.
  /// \param x slopes of columns, of which every step-th counts, `count` of them.
  /// \param depth of the same, m; NaN: nothing was measured.
  void addRow(const double* x, double y, const float* depth, int step, int count);

  /// Of the pixels that see the bounded patch and measured something, the share that
  /// measured another 1/z, by more than `tolerance`, 1/m; zero where none sees it.
  double strayShare(const Patch& patch, const Pose& camera, double tolerance);

  /// 1/z at which each ray meets the bounded patch, 1/m; zero where it misses. Valid
  /// until the next call.
  const std::vector<double>& meet(const Patch& patch, const Pose& camera);

private:
  void makeRoom(std::size_t more);

  std::size_t count_ = 0;
  std::vector<double> x_, y_, measured_; ///< with room for more than there are
  std::vector<double> met_;
};

} // namespace holdfast
