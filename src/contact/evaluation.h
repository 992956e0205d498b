/// \file A foot at one place of a surface, in any direction.
#pragma once

#include "contact/field.h"
#include "contact/gaussian_events.h"
#include "contact/sole.h"
#include <holdfast/contact/contact_risk.h>

#include <algorithm>
#include <optional>
#include <vector>

namespace holdfast::contact {

/// What a number certainly is not below, nor above.
struct Range {
  double low = 0.0, high = 0.0;
};

/// A sole on one surface as a Gaussian field: what may go wrong there.
class FieldRisk {
public:
  /// \param planned_slope of a stiff ankle's sole.
  /// Field and foot must outlive this.
  FieldRisk(const Field& field, const Foot& foot, const Eigen::Vector2d& planned_slope);

  /// Probabilities at single places bound those of their union.
  Range totalWithin(const SolePlaces& extremes) const;

  /// ContactEvents::total without support.
  double total(const SolePlaces& extremes);

  /// All but `support`, and `total` and `joint` without it.
  ContactEvents at(const SolePlaces& extremes);

  /// Expected share of places nearer to the sole than this.
  double shareWithin(const SolePlaces& places, double limit) const;

  /// Of the surface off the sole, at one of its places.
  GaussianShare residual(const SolePlaces& places, Eigen::Index place) const;

private:
  /// That the gap is exceeded, by place.
  struct GapByPlace {
    double largest = 0.0, sum = 0.0;
    Eigen::Index leading = 0; ///< where it is the largest

    double most() const
    {
      return std::max(largest, std::min(sum, 1.0));
    }
  };

  GapByPlace gapByPlace(const SolePlaces& extremes) const;
  double gapOf(const SolePlaces& extremes);
  /// After gapOf() of the same extremes.
  double jointOf(const ContactEvents& risk, const SolePlaces& extremes);
  double totalWith(double gap) const
  {
    return common_.slip + common_.height + common_.tilt + gap;
  }
  FieldVector steepest() const;
  Lines& lines();

  const Field& field_;
  const Foot& foot_;
  ShapeVector shape_mean_;
  ShapeMatrix shape_root_;
  Eigen::Vector2d planned_slope_;
  ContactEvents common_; ///< slip, height and tilt: of any yaw
  std::optional<Lines> lines_; ///< where bounds do not do
};

class Evaluation {
public:
  /// \param foot of all soles that are asked for.
  /// \param placement a valid one; soles are turned beyond its yaw.
  /// The surface and the foot must outlive this.
  Evaluation(const ContactSurface& surface,
             const Foot& foot,
             const Placement& placement);
  Evaluation(const Evaluation&) = delete;
  Evaluation& operator=(const Evaluation&) = delete;

  bool isFacingTheLoad() const
  {
    return field_.has_value();
  }

  /// Share of a sole over surface that was seen; the surface faces the load.
  double supportShare(const Sole& sole) const;

  bool isEnough(double support_share) const
  {
    return support_share >= foot_.tolerances.min_support;
  }

  /// Everything. What all directions share is worked out at the first with support.
  ContactRisk at(const Sole& sole);

  /// ContactEvents::total of a sole with enough support, and what it is within without
  /// much work.
  double total(const Sole& sole, double support_share);
  Range totalWithin(const Sole& sole, double support_share);

  /// Expected area in contact, m^2, of a sole with enough support.
  double contactArea(const Sole& sole);

private:
  /// A hypothesis of the surface.
  struct Part {
    double share;
    Field field;
    std::optional<FieldRisk> risk;
  };

  const SolePlaces& extremesOf(const Sole& sole) const
  {
    return sole.extremes(surface_.isQuadric());
  }
  /// The hypotheses, worked out when they are first asked for.
  std::vector<Part>& parts();
  ContactEvents risksAt(const Sole& sole);
  double worstGap(const Sole& sole);
  void placeSole(double turn, ContactQuality& quality) const;

  const ContactSurface& surface_;
  const Foot& foot_;
  Pose load_; ///< frame of the load at the placement's yaw
  std::optional<Field> field_; ///< over all hypotheses
  Eigen::Vector2d planned_slope_ = Eigen::Vector2d::Zero(); ///< of a stiff ankle's sole
  std::vector<Part> parts_;
};

} // namespace holdfast::contact
