/// \file The points of one neighbourhood and their covariances, laid out for the
/// kernel.
#pragma once

#include <holdfast/correlated_noise.h>

#include <Eigen/Core>

#include <memory>
#include <utility>
#include <vector>

namespace holdfast {

/// A point whose covariance has a trace larger than this many times the median of its
/// neighbourhood, a sigma ten times as large, is left out of the fit. Sensors vary by a
/// factor of 2 to 4 in sigma over a neighbourhood, so only outliers of another kind are
/// met; each carries less than 1 % of a typical point's information, but would enter
/// mean and scatter, which are not weighted, in full.
inline constexpr double kUninformativeTraceRatio = 100.0;

/// N points with covariances in structure-of-arrays form: ten channels
/// x y z sxx sxy sxz syy syz szz w in one aligned block, padded to a multiple of
/// kLaneMultiple with points of weight 0, three more for the points at which a noise
/// model is to be evaluated (holdfast/fit/reference_points.h), and six for errors that
/// points share (setPattern()). Coordinates are
/// relative to `origin()`, so that clouds far from zero lose no precision. Memory is
/// kept between uses: a batch that is refilled does not allocate once it has seen its
/// largest neighbourhood.
class PointBatch {
public:
  // clang-format off
  enum Channel {
    X, Y, Z, SXX, SXY, SXZ, SYY, SYZ, SZZ, W,
    RX, RY, RZ, ///< where to evaluate the noise model
    U, V, ///< pixel of the sensor's camera
    EX, EY, EZ, ///< how the point moves with the shared error, per unit of it
    EXTRA, ///< for the fit
    kChannels
  };
  // clang-format on
  static constexpr int kLaneMultiple = 16;

  /// Forgets all points; `origin` in world coordinates should be near the points to
  /// come. The viewpoint is the world's origin again, and there is no pattern.
  void clear(const Eigen::Vector3d& origin);

  /// The same, for points seen from a viewpoint.
  /// \throw std::invalid_argument when it is not finite.
  void clear(const Eigen::Vector3d& origin, const Eigen::Vector3d& viewpoint);

  /// Where the sensor stood, world frame, m: normals point to its side.
  /// \throw std::invalid_argument when it is not finite.
  void setViewpoint(const Eigen::Vector3d& viewpoint);

  const Eigen::Vector3d& viewpoint() const
  {
    return viewpoint_;
  }

  /// Tells that the errors of the points are correlated. Their pixels (U, V) and the
  /// directions of their shared error (EX, EY, EZ) are to be written through channel();
  /// the covariances are those of single points, shared error included. Weights and
  /// estimate do not depend on it, the covariance of the estimate does.
  void setPattern(std::shared_ptr<const CorrelatedNoise> pattern)
  {
    pattern_ = std::move(pattern);
  }

  /// Null: all errors are independent.
  const CorrelatedNoise* pattern() const
  {
    return pattern_.get();
  }

  const std::shared_ptr<const CorrelatedNoise>& sharedPattern() const
  {
    return pattern_;
  }

  /// Makes room for n points without allocating later.
  void reserve(int n);

  /// Adds a world point with its covariance (world axes). No check is made here; see
  /// removeInvalid().
  void add(const Eigen::Vector3d& point, const Eigen::Matrix3d& covariance);

  /// Drops points with a non-finite coordinate or covariance, and points whose
  /// covariance is not positive semi-definite (within single-precision rounding).
  /// \return how many were dropped.
  int removeInvalid();

  /// Adds floor^2 I to covariances whose trace is below floor^2, so that exact points
  /// do not get infinite weight.
  void applyFloor(double sigma_floor_m);

  /// Drops points that cannot inform beside the others: trace of the covariance above
  /// kUninformativeTraceRatio times the (lower) median. Which they are depends on the
  /// covariances alone, so the estimate stays differentiable in the points.
  /// \return how many were dropped; less than half.
  int removeUninformative();

  /// Brings the padding after the last point up to date. fitPatch() calls it.
  void pad();

  int size() const
  {
    return size_;
  }

  /// size() rounded up to kLaneMultiple; valid after pad().
  int paddedSize() const;

  const Eigen::Vector3d& origin() const
  {
    return origin_;
  }

  double* channel(Channel c)
  {
    return data_.get() + static_cast<std::ptrdiff_t>(c) * capacity_;
  }
  const double* channel(Channel c) const
  {
    return data_.get() + static_cast<std::ptrdiff_t>(c) * capacity_;
  }

  /// Sets the number of points, keeping those there; new ones are to be written through
  /// channel() by the caller (the fast way to fill a batch).
  void resize(int n);

  /// World coordinates of point i.
  Eigen::Vector3d point(int i) const;

  /// Covariance of point i, world axes.
  Eigen::Matrix3d covariance(int i) const;

private:
  void movePoint(int from, int to);

  struct Deleter {
    void operator()(double* p) const;
  };
  std::unique_ptr<double[], Deleter> data_;
  int size_ = 0;
  int capacity_ = 0;
  Eigen::Vector3d origin_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d viewpoint_ = Eigen::Vector3d::Zero();
  std::shared_ptr<const CorrelatedNoise> pattern_;
};

} // namespace holdfast
