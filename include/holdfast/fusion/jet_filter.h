/// \file The jet of one spot from many views.
#pragma once

#include <holdfast/fusion/jet.h>

#include <Eigen/Core>

#include <array>
#include <limits>

namespace holdfast {

/// Symmetric n x n matrix as its upper triangle, row by row.
template <int n>
struct Packed {
  static constexpr int kSize = n * (n + 1) / 2;
  std::array<double, kSize> v{};

  template <typename Derived>
  static Packed of(const Eigen::MatrixBase<Derived>& S)
  {
    Packed packed;
    for (int i = 0, e = 0; i < n; ++i)
      for (int j = i; j < n; ++j, ++e)
        packed.v[static_cast<std::size_t>(e)] = S(i, j);
    return packed;
  }

  Eigen::Matrix<double, n, n> matrix() const
  {
    Eigen::Matrix<double, n, n> S;
    for (int i = 0, e = 0; i < n; ++i)
      for (int j = i; j < n; ++j, ++e)
        S(i, j) = S(j, i) = v[static_cast<std::size_t>(e)];
    return S;
  }
};

/// A Kalman filter of a jet x at a fixed anchor. A view measures x + b + w: w is white;
/// the pattern b is common to views through the same pixels, and independent where they
/// have nothing in common. So over n views of a camera that stands still the covariance
/// of x tends to that of b, and not to nothing (FUSION 3).
class JetFilter {
public:
  /// Where a first view leaves it: in an epoch of its own.
  explicit JetFilter(const Jet& first);
  JetFilter() = default;

  const JetVector& value() const
  {
    return value_;
  }

  JetMatrix covariance() const
  {
    return joint_.matrix().topLeftCorner<6, 6>();
  }

  /// The spot is seen through other pixels: of the pattern this share of each number is
  /// left, and the rest is drawn anew.
  /// \param kept in [0, 1]; zero begins another epoch.
  void changePattern(const JetVector& kept, const JetMatrix& pattern);

  /// What is common to all errors from now on, such as motion: covariance is added.
  void inflate(const JetMatrix& covariance);

  /// What was known counts less by this factor (> 1) of its covariance.
  void fade(double factor);

  /// Surprise by a view: (j - x - b)^T S^-1 (j - x - b), chi-square with six degrees of
  /// freedom. Infinite when S is no covariance.
  /// \param white of the view, with all that is no pattern.
  double distance(const JetVector& jet, const JetMatrix& white) const;

  /// \param gate largest distance() of a view that is taken.
  /// \return false, and nothing done, when it is further, or the innovation has no
  /// covariance.
  bool update(const JetVector& jet,
              const JetMatrix& white,
              double gate = std::numeric_limits<double>::infinity());

  /// [x b] and their covariance, for files.
  const JetVector& patternValue() const
  {
    return pattern_;
  }
  const Packed<12>& joint() const
  {
    return joint_;
  }
  static JetFilter restored(const JetVector& value,
                            const JetVector& pattern,
                            const Packed<12>& joint);

private:
  JetVector value_ = JetVector::Zero();
  JetVector pattern_ = JetVector::Zero(); ///< estimate of b
  Packed<12> joint_; ///< covariance of [x b]
};

} // namespace holdfast
