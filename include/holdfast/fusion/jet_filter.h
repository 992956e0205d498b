/// \file The jet of one spot from many views.
#pragma once

#include <holdfast/fusion/jet.h>

#include <Eigen/Core>

#include <array>
#include <limits>

namespace holdfast {

/// Symmetric n x n matrix as its upper triangle, row by row.
template <int n, typename Scalar = double>
struct Packed {
  static constexpr int kSize = n * (n + 1) / 2;
  std::array<Scalar, kSize> v{};

  template <typename Derived>
  static Packed of(const Eigen::MatrixBase<Derived>& S)
  {
    Packed packed;
    for (int i = 0, e = 0; i < n; ++i)
      for (int j = i; j < n; ++j, ++e)
        packed.v[static_cast<std::size_t>(e)] = static_cast<Scalar>(S(i, j));
    return packed;
  }

  Eigen::Matrix<double, n, n> matrix() const
  {
    Eigen::Matrix<double, n, n> S;
    for (int i = 0, e = 0; i < n; ++i)
      for (int j = i; j < n; ++j, ++e)
        S(i, j) = S(j, i) = static_cast<double>(v[static_cast<std::size_t>(e)]);
    return S;
  }
};

/// A Kalman filter of a jet x at a fixed anchor. A view measures x + b + D t + w: w is
/// white; the pattern b is common to views through the same pixels, and independent
/// where they have nothing in common. So over n views of a camera that stands still the
/// covariance of x tends to that of b, and not to nothing (FUSION 3). The third
/// derivatives t of the surface are the same in all views: a view's fit makes of them
/// D t (holdfast/fusion/roughness.h), which averages no more than D does. They are not
/// estimated, but considered (Schmidt's filter): the estimate knows how it depends on
/// them, so that it counts when they turn out larger or smaller than they seemed.
class JetFilter {
public:
  /// Everything there is, for files.
  struct State {
    JetVector value = JetVector::Zero();
    JetVector pattern = JetVector::Zero(); ///< estimate of b
    /// Covariance of [x b], without what third derivatives do. In single precision,
    /// which leaves of x + b, where the pattern cancels, a thousandth after 64 views
    /// whose white error is a tenth of it; a patch shall not take a kibibyte.
    Packed<12, float> joint;
    /// d(estimate of [x b]) / dt: it says how large an error is, and none is made with
    /// it.
    Eigen::Matrix<float, 12, 4> by_third = Eigen::Matrix<float, 12, 4>::Zero();
    double s3_per_m2 = 0.0; ///< root mean square of t
  };

  /// Where a first view leaves it: in an epoch of its own.
  /// \param by_third D of the view
  /// \param s3_per_m2 root mean square of t
  explicit JetFilter(const Jet& first,
                     const ThirdToJet& by_third = ThirdToJet::Zero(),
                     double s3_per_m2 = 0.0);
  JetFilter() = default;
  explicit JetFilter(const State& state) : state_(state) {}

  const JetVector& value() const
  {
    return state_.value;
  }

  JetMatrix covariance() const;

  /// The spot is seen through other pixels: of the pattern this share of each number is
  /// left, and the rest is drawn anew.
  /// \param kept in [0, 1]; zero begins another epoch.
  void changePattern(const JetVector& kept, const JetMatrix& pattern);

  /// What is common to all errors from now on, such as motion: covariance is added.
  void inflate(const JetMatrix& covariance);

  /// Third derivatives are now known to be so large, 1/m^2: what they have done to the
  /// estimate counts accordingly.
  void setRoughness(double s3_per_m2)
  {
    state_.s3_per_m2 = s3_per_m2;
  }

  /// What was known counts less by this factor (> 1) of its covariance.
  void fade(double factor);

  /// Surprise by a view: (j - x - b)^T S^-1 (j - x - b), chi-square with six degrees of
  /// freedom. Infinite when S is no covariance.
  /// \param white of the view, with all that is no pattern.
  double distance(const JetVector& jet, const JetMatrix& white) const;

  /// \param gate largest surprise of a view that is taken: distance(), with D t.
  /// \param by_third D of the view
  /// \return false, and nothing done, when it is further, or the innovation has no
  /// covariance.
  bool update(const JetVector& jet,
              const JetMatrix& white,
              double gate = std::numeric_limits<double>::infinity(),
              const ThirdToJet& by_third = ThirdToJet::Zero());

  const State& state() const
  {
    return state_;
  }

private:
  State state_;
};

} // namespace holdfast
