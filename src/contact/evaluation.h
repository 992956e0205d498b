/// \file A foot at one place of a surface, in any direction.
#pragma once

#include "contact/field.h"
#include "contact/sole.h"
#include <holdfast/contact/contact_risk.h>

#include <optional>

namespace holdfast::contact {

class Evaluation {
public:
  /// \param placement a valid one.
  /// The surface and the sole must outlive this.
  Evaluation(const ContactSurface& surface,
             const Sole& sole,
             const Placement& placement);
  Evaluation(const Evaluation&) = delete;
  Evaluation& operator=(const Evaluation&) = delete;

  /// \param turn of the sole beyond the placement's yaw. What all of them share is
  /// worked out at the first that has support.
  ContactRisk atYaw(double turn);

private:
  /// The sole's rows at a yaw: off the surface by N(mean, sigma^2).
  struct Residuals {
    ShapeRows rows;
    Eigen::VectorXd mean, sigma;
  };

  double supportShare(double turn) const;
  Residuals residualsOf(const SolePlaces& places, double turn) const;
  void workOutCommon();
  double gapOf(const Residuals& extremes, const Eigen::VectorXd& own);
  /// After gapOf() of the same residuals.
  double jointOf(const ContactEvents& risk,
                 const Residuals& extremes,
                 const Eigen::VectorXd& own);
  FieldVector steepest() const;
  double areaAt(double turn) const;
  void placeSole(double turn, ContactQuality& quality) const;

  const ContactSurface& surface_;
  const Sole& sole_;
  Pose load_; ///< frame of the load at the placement's yaw
  std::optional<Field> field_;
  Eigen::Vector2d planned_slope_ = Eigen::Vector2d::Zero(); ///< of a stiff ankle's sole
  std::optional<ContactEvents> common_; ///< slip, height and tilt
  std::optional<Lines> lines_;
};

} // namespace holdfast::contact
