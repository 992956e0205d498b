#include <holdfast/contact/patch_contact.h>

#include "contact/evaluation.h"
#include "contact/field.h"
#include "contact/require.h"
#include "contact/sole.h"
#include <holdfast/patch/boundary.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>

namespace holdfast {
namespace {

/// The expected surface less the pad at places of the pad, pressed on evenly.
struct Misfit {
  Eigen::VectorXd off;
  double lift = 0.0; ///< of the pad that makes the worse of the two least

  Misfit(const contact::SolePlaces& places,
         const contact::Field& field,
         double turn,
         const PatchContactOptions& options)
  : off(contact::turnedRows(places.rows, turn) * field.shapeMean() - places.own)
  {
    const double gap = options.max_gap_m, in = options.max_penetration_m;
    lift = (gap * off.maxCoeff() + in * off.minCoeff()) / (gap + in);
  }

  double penetration() const
  {
    return std::max(off.maxCoeff() - lift, 0.0);
  }
  double gap() const
  {
    return std::max(lift - off.minCoeff(), 0.0);
  }
  /// In shares of what it may be.
  double worst(const PatchContactOptions& options) const
  {
    return std::max(gap() / options.max_gap_m,
                    penetration() / options.max_penetration_m);
  }
};

/// The turn with the least misfit: the best of a fan, refined by golden sections.
double
bestTurn(const contact::Sole& pad,
         const contact::Field& field,
         const PatchContactOptions& options)
{
  const auto misfit = [&](double turn) {
    return Misfit(pad.cells(), field, turn, options).worst(options);
  };
  constexpr int kFan = 36;
  const double step = options.max_turn_rad / kFan;
  double best = 0.0, least = misfit(0.0);
  for (int i = -kFan; i <= kFan; ++i)
    if (const double m = misfit(i * step); m < least) {
      least = m;
      best = i * step;
    }
  double low = std::max(best - step, -options.max_turn_rad);
  double high = std::min(best + step, options.max_turn_rad);
  const double golden = 0.5 * (std::sqrt(5.0) - 1.0);
  while (high - low > 1e-4) {
    const double a = high - golden * (high - low), b = low + golden * (high - low);
    (misfit(a) < misfit(b) ? high : low) = misfit(a) < misfit(b) ? b : a;
  }
  const double refined = 0.5 * (low + high);
  return misfit(refined) < least ? refined : best;
}

/// The normal of a slope, turned towards z until it is no further than an angle.
Eigen::Vector3d
limitedNormal(const Eigen::Vector2d& slope, double max_tilt_rad)
{
  const double tilt = std::atan(slope.norm());
  const double scale =
      tilt > max_tilt_rad ? std::tan(max_tilt_rad) / slope.norm() : 1.0;
  return Eigen::Vector3d(-scale * slope.x(), -scale * slope.y(), 1.0).normalized();
}

/// Probability that the surface is somewhere beyond [low, high] above the lifted pad.
double
beyond(const contact::Field& field,
       const contact::SolePlaces& pad,
       const Misfit& misfit,
       double low,
       double high)
{
  contact::Lines lines(field);
  Eigen::Index worst = 0;
  (misfit.off.array() - misfit.lift - 0.5 * (low + high)).abs().maxCoeff(&worst);
  contact::FieldVector event = contact::FieldVector::Zero();
  event.tail<contact::kShape>() = pad.rows.row(worst).transpose();
  lines.setDirection(event);
  const Eigen::VectorXd own = pad.own.array() + misfit.lift + 0.5 * (low + high);
  lines.keepShape(pad.rows, own, 0.5 * (high - low));
  return lines.outside();
}

void
addRisks(const contact::Field& field,
         double share,
         const contact::SolePlaces& extremes,
         const Misfit& misfit,
         const PatchContactOptions& options,
         PatchFitness& fitness)
{
  // Farther than anything a pad meets, and near enough for single precision.
  constexpr double kFar = 1.0;
  const double gap = options.max_gap_m, in = options.max_penetration_m;
  fitness.gap_risk += share * beyond(field, extremes, misfit, -gap, kFar);
  fitness.penetration_risk += share * beyond(field, extremes, misfit, -kFar, in);
  fitness.risk += share * beyond(field, extremes, misfit, -gap, in);
}

} // namespace

std::string
validityError(const PatchContactOptions& options)
{
  for (const double x : {options.max_gap_m, options.max_penetration_m})
    if (!std::isfinite(x) || x <= 0.0)
      return "gap and penetration must be allowed some length > 0";
  if (!(options.max_tilt_rad >= 0.0 && options.max_tilt_rad < 1.5))
    return "the tilt that is allowed must be between 0 and 1.5 rad";
  return options.max_turn_rad >= 0.0 && options.max_turn_rad <= kPi ?
             "" :
             "the turn that is allowed must be between 0 and pi";
}

Foot
padOf(const Patch& patch, double spacing_m)
{
  contact::requireValid("patchContact", validityError(patch));
  Foot pad;
  // Seen from inside the robot, x stays and y turns round.
  for (const Eigen::Vector2d& corner : outline(patch, spacing_m))
    pad.sole.emplace_back(corner.x(), -corner.y());
  pad.curvature = -patch.principalCurvatures();
  return pad;
}

PatchContact
patchContact(const ContactSurface& surface,
             const Foot& pad,
             const Placement& placement,
             const PatchContactOptions& options)
{
  contact::requireValid("patchContact", validityError(options));
  contact::requireValid("patchContact", validityError(placement));
  const contact::Sole sole(pad);
  PatchContact result;
  const Pose load = loadFrame(placement);
  const auto field = contact::fieldAt(surface, load);
  if (!field) {
    result.status = ContactStatus::NotFacingTheLoad;
    return result;
  }
  // In the pad's own plane: the surface as it is seen along the pad's normal.
  const Eigen::Vector3d n =
      limitedNormal(field->mean.segment<2>(1), options.max_tilt_rad);
  Placement tilted = placement;
  tilted.point = load.toWorld({0.0, 0.0, field->mean[0]});
  tilted.load_direction = -(load.R * n);
  const contact::Evaluation evaluation(surface, pad, tilted);
  const Pose plane = loadFrame(tilted);
  const auto seen = contact::fieldAt(surface, plane);
  if (!seen) {
    result.status = ContactStatus::NotFacingTheLoad;
    return result;
  }
  const double turn = bestTurn(sole, *seen, options);
  const contact::Sole turned = sole.turned(turn);
  result.support_share = evaluation.supportShare(turned);
  if (result.support_share < pad.tolerances.min_support)
    return result;

  result.status = ContactStatus::Ok;
  const Misfit cells(sole.cells(), *seen, turn, options);
  PatchFitness& fitness = result.fitness.emplace();
  fitness.gap_m = cells.gap();
  fitness.penetration_m = cells.penetration();
  fitness.pose.R = plane.R * Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitZ());
  fitness.pose.c = plane.toWorld({0.0, 0.0, seen->mean[0] + cells.lift});
  Misfit extremes(sole.extremes(false), *seen, turn, options);
  extremes.lift = cells.lift;
  if (surface.hypotheses.empty())
    addRisks(*seen, 1.0, turned.extremes(false), extremes, options, fitness);
  for (const SurfaceHypothesis& hypothesis : surface.hypotheses)
    if (const auto one = contact::fieldAt(surface, hypothesis, plane))
      addRisks(*one,
               hypothesis.share,
               turned.extremes(false),
               extremes,
               options,
               fitness);
  return result;
}

} // namespace holdfast
