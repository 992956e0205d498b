/// \file A surface in the frame of the load, as random numbers.
#pragma once

#include "contact/sole.h"
#include <holdfast/contact/contact_risk.h>

#include <Eigen/Core>

#include <optional>

namespace holdfast::contact {

/// [h gx gy | kxx kxy kyy | xxx xxy xyy yyy] of the surface itself, at the load.
inline constexpr int kField = 10;
using FieldVector = Eigen::Matrix<double, kField, 1>;
using FieldMatrix = Eigen::Matrix<double, kField, kField>;

/// Its last numbers are the shape that shows under a sole.
inline constexpr int kShapeStart = kField - kShape;

/// field = mean + factor * z, z ~ N(0, I). What shows under a sole does not depend on
/// the three numbers from kNotOfShape on.
struct Field {
  static constexpr int kNotOfShape = 3;

  FieldVector mean;
  FieldMatrix factor;

  auto shapeMean() const
  {
    return mean.tail<kShape>();
  }
  /// What the shape has of the numbers it depends on.
  ShapeMatrix shapeRoot() const
  {
    ShapeMatrix root;
    root << factor.bottomLeftCorner<kShape, kNotOfShape>(),
        factor.bottomRightCorner<kShape, kShape - kNotOfShape>();
    return root;
  }
  Eigen::Matrix2d slopeCovariance() const
  {
    const auto rows = factor.middleRows<2>(1);
    return rows * rows.transpose();
  }
};

/// \param load its frame, in that of the surface.
/// \return nothing where the surface is not seen along the load.
std::optional<Field> fieldAt(const ContactSurface& surface,
                             const SurfaceHypothesis& hypothesis,
                             const Pose& load);

/// Over all hypotheses.
std::optional<Field> fieldAt(const ContactSurface& surface, const Pose& load);

/// Probability that none of some events happens, by integrating exactly along lines
/// through quasi-random nodes: what is all right is convex for every one of them, so
/// that each line has one piece of it.
class Lines {
public:
  static constexpr int kLogLines = 9, kLines = 1 << kLogLines;
  // Single precision tells residuals to 1e-9 m and takes half the time.
  using Nodes = Eigen::Matrix<float, kField, kLines, Eigen::RowMajor>;
  using Row = Eigen::Array<float, 1, kLines>;

  explicit Lines(const Field& field);

  /// Sets the direction of all lines: across the limit of an event, where its
  /// probability would be roughest otherwise; and drops all limits.
  /// \param event coefficients of the field
  void setDirection(const FieldVector& event);

  /// |rows * shape - own| <= limit for all rows.
  void keepShape(const ShapeRows& rows, const Eigen::VectorXd& own, double limit);
  void keepHeight(double limit);
  /// |slope - centre| <= limit.
  void keepSlope(const Eigen::Vector2d& centre, double limit);
  /// |slope| <= friction, drawn anew on every line.
  void keepFriction(const Friction& friction);

  /// Probability that a limit is exceeded.
  double outside() const;

private:
  void keepWithin(const Row& middle, float along, float limit);
  void keepSlopes(const Eigen::Vector2d& centre, const Row& limits);
  void startNumber(int number);
  /// Height and slopes, which few events ask for, start where they are needed.
  void startHeightAndSlopes();

  const Field& field_;
  Nodes places_; ///< factor * nodes
  Nodes starts_; ///< of the lines, in the field
  Row feet_; ///< by how much the nodes are mirrored
  Eigen::Matrix<float, kField, 1> along_, step_;
  bool has_placed_all_ = false, has_started_all_ = false;
  Row low_, high_;
};

} // namespace holdfast::contact
