/// \file The points of a neighbourhood as its patch sees them.
#pragma once

#include "fit/kernel.h"
#include "patch/boundary_form.h"
#include <holdfast/fit/point_batch.h>
#include <holdfast/patch/patch.h>
#include <holdfast/validation/coverage.h>
#include <holdfast/validation/residual.h>

#include <vector>

namespace holdfast {

/// The finite ones among the points, placed about a patch in one pass. Uses working
/// memory of the thread: one at a time.
class LocalPoints {
public:
  LocalPoints(const Patch& patch, const PointBatch& points);

  /// \param points in world coordinates.
  LocalPoints(const Patch& patch, const std::vector<Eigen::Vector3d>& points);

  int size() const
  {
    return size_;
  }

  Eigen::Vector3d operator[](int i) const
  {
    return {placed_.q[0][i], placed_.q[1][i], placed_.q[2][i]};
  }

  const double* x() const
  {
    return placed_.q[0];
  }

  const double* y() const
  {
    return placed_.q[1];
  }

  bool isInside(int i) const
  {
    return placed_.reach[i] <= BoundaryForm::kEdge;
  }

  /// The approximate one (approximateDistanceToSurface()); perhaps not finite for
  /// points out of all proportion.
  double squaredDistance(int i) const
  {
    return placed_.squared_distance[i];
  }

  /// Of the point's error along the normal at the patch's centre, m^2; zero without
  /// covariances.
  double variance(int i) const
  {
    return placed_.variance[i];
  }

private:
  void place(const Patch& patch, const PointBatch& points);
  void leaveOutInvalid();

  int size_ = 0;
  kernel::PlacedPoints placed_{};
};

/// measureResidual() and measureCoverage() of points that are placed.
SurfaceResidual residualOf(const Patch& patch, const LocalPoints& points);

/// \throw std::invalid_argument when the options make no sense.
Coverage coverageOf(const Patch& patch,
                    const LocalPoints& points,
                    const CoverageOptions& options);

} // namespace holdfast
