/// \file A foot at one place of a surface, in any direction.
#pragma once

#include "contact/field.h"
#include "contact/sole.h"
#include <holdfast/contact/contact_risk.h>

#include <optional>
#include <vector>

namespace holdfast::contact {

/// Under a sole at one yaw: the surface is off it by rows * shape - own.
struct SoleAtYaw {
  SoleAtYaw(const SolePlaces& places, double turn)
  : rows(turnedRows(places.rows, turn)), own(places.own)
  {}
  ShapeRows rows;
  const Eigen::VectorXd& own;
};

/// A sole on one surface as a Gaussian field: what may go wrong there.
class FieldRisk {
public:
  /// \param planned_slope of a stiff ankle's sole.
  /// Field and foot must outlive this.
  FieldRisk(const Field& field, const Foot& foot, const Eigen::Vector2d& planned_slope);

  /// All but `support`, and `total` and `joint` without it.
  ContactEvents at(const SoleAtYaw& extremes);

private:
  double gapOf(const SoleAtYaw& extremes);
  /// After gapOf() of the same extremes.
  double jointOf(const ContactEvents& risk, const SoleAtYaw& extremes);
  FieldVector steepest() const;

  const Field& field_;
  const Foot& foot_;
  Eigen::Vector2d planned_slope_;
  ContactEvents common_; ///< slip, height and tilt: of any yaw
  Lines lines_;
};

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

  /// Share of the sole over surface that was seen; the surface faces the load.
  double supportShare(double turn) const;

private:
  /// A hypothesis of the surface.
  struct Part {
    double share;
    Field field;
    std::optional<FieldRisk> risk;
  };

  void workOutParts();
  ContactEvents risksAt(const SoleAtYaw& extremes);
  double worstGap(const SoleAtYaw& extremes) const;
  double areaAt(double turn) const;
  void placeSole(double turn, ContactQuality& quality) const;

  const ContactSurface& surface_;
  const Sole& sole_;
  Pose load_; ///< frame of the load at the placement's yaw
  std::optional<Field> field_; ///< over all hypotheses
  Eigen::Vector2d planned_slope_ = Eigen::Vector2d::Zero(); ///< of a stiff ankle's sole
  std::vector<Part> parts_;
};

} // namespace holdfast::contact
