/// \file How likely a contact fails: from a surface with covariance to "may I step
/// here?"
///
/// Everything happens in the frame whose z axis is against the load, at the planned
/// point. The jet of the surface there is Gaussian, and every event is a condition on
/// it: the height off plan, the slope beyond friction, the surface away from the sole.
///
/// What the numbers take for granted, in words for whoever reads them:
/// kRiskAssumptions.
#pragma once

#include <holdfast/contact/foot.h>
#include <holdfast/fusion/patch_map.h>

#include <array>
#include <optional>
#include <string_view>
#include <vector>

namespace holdfast {

/// Written beside every result.
inline constexpr std::array<std::string_view, 7> kRiskAssumptions{
    "the surface is rigid and bears the load wherever it was seen",
    "what was seen is what the one patch under the planned point covers: ground under "
    "the sole that only its neighbours cover counts as not seen",
    "errors of a surface are Gaussian with the covariance of its patch; its slope and "
    "curvatures, and what of it is no quadric, are those of a kind of surface in the "
    "map",
    "friction is lognormal and independent of the surface; slip is the load leaving "
    "the "
    "friction cone about the normal, without torque",
    "the foot arrives exactly at its planned point, with the planned yaw",
    "total is the sum over all events, at most 1 (union bound); joint counts what they "
    "have in common",
    "nothing is said of what lies beyond the sole, of the leg, or of balance"};

/// What a surface may be, and how likely it is that.
struct SurfaceHypothesis {
  double share = 1.0;
  Jet jet; ///< at the anchor
  /// Root mean square third derivative, 1/m^2; 0: a quadric and nothing else.
  double s3_per_m2 = 0.0;
};

/// A piece of surface that may be touched.
struct ContactSurface {
  Jet jet; ///< at the anchor
  double s3_per_m2 = 0.0; ///< as SurfaceHypothesis
  /// Where several kinds of surface are possible, these count, and jet and s3_per_m2
  /// are what they have as mean and covariance. Empty: those are all.
  std::vector<SurfaceHypothesis> hypotheses;
  Pose anchor; ///< frame of the map, or of the sensor
  /// Where it was seen, in the plane of the anchor, in radii of radius_m.
  SupportGrid support;
  double radius_m = 0.0; ///< of the disc whose best quadric it is

  bool isQuadric() const
  {
    return hypotheses.empty() && s3_per_m2 == 0.0;
  }
};

/// One kind of the surfaces of a scene: slopes, second and third derivatives are
/// isotropic Gaussian numbers.
struct SurfaceKind {
  double share = 1.0; ///< of all surfaces
  double slope = 0.0; ///< standard deviation of each of gx gy, against the load
  /// xx xy yy have the covariance curvature_per_m^2 [1 0 1/3; 0 1/3 0; 1/3 0 1].
  double curvature_per_m = 0.0;
  double s3_per_m2 = 0.0; ///< SurfaceHypothesis
};

/// What is known of a scene before a place of it is looked at. Without it a surface may
/// be anything, and what is measured badly counts as as steep and as bent as its noise
/// makes it look; with one kind alone, level ground counts as as rough as the edges
/// beside it.
struct SurfacePrior {
  std::vector<SurfaceKind> kinds; ///< the smoothest first; empty: nothing is known
  double noise_scale = 1.0; ///< of chi-square on what is smooth
  Eigen::Vector3d load_direction = -Eigen::Vector3d::UnitZ(); ///< frame of the map
};

/// As the patches of a map tell it: the kinds, from smooth to rough, that make their
/// slopes, curvatures and misfits likeliest (expectation maximisation, from a fixed
/// start). Nothing for a map with less than 30 patches that face the load.
/// \param load_direction frame of the map, of any length but zero.
SurfacePrior surfacePriorOf(const PatchMap& map, const Eigen::Vector3d& load_direction);

/// Kinds that a patch is of with less than this probability are left out, so that no
/// probability is off by more than it for each of them.
inline constexpr double kUnlikelyKind = 1e-4;

/// A patch of a map, with its roughness, and what is known of all surfaces there.
ContactSurface contactSurfaceOf(const PatchMap& map,
                                const MapPatch& patch,
                                const SurfacePrior& prior);

/// A single patch: seen wherever its boundary is.
/// \return nothing where the fit is not usable.
std::optional<ContactSurface> contactSurfaceOf(const FitResult& fit);

/// Where and how a foot is to be put.
struct Placement {
  /// Where the load acts, frame of the surface, m.
  Eigen::Vector3d point = Eigen::Vector3d::Zero();
  /// Of the force on the surface; of any length but zero.
  Eigen::Vector3d load_direction = -Eigen::Vector3d::UnitZ();
  /// Of the sole's x axis about the axis against the load, rad; at 0 it is the frame's
  /// x axis, or its y axis where the load is along x, as seen along the load.
  double yaw = 0.0;
  /// Of a stiff ankle's sole, out of the surface; none: the normal that is expected.
  std::optional<Eigen::Vector3d> sole_normal;
};

/// Empty when the placement makes sense, else one sentence.
std::string validityError(const Placement& placement);

/// Origin at the planned point, z against the load, x the sole's.
Pose loadFrame(const Placement& placement);

enum class ContactStatus : std::uint8_t {
  Ok,
  InsufficientSupport, ///< too little of what is under the sole was seen
  NotFacingTheLoad ///< the load passes the surface by, or grazes it
};

/// Probabilities of what may go wrong.
struct ContactEvents {
  double slip = 0.0; ///< |slope| exceeds the friction
  double height = 0.0; ///< ContactTolerances::height_m
  double tilt = 0.0; ///< ContactTolerances::tilt_rad; 0 with a compliant ankle
  double gap = 0.0; ///< ContactTolerances::gap_m somewhere under the sole
  double support = 0.0; ///< share of the sole over surface that was not seen
  double total = 0.0; ///< their sum, at most 1
  /// Of any of slip, height, tilt and gap, with what they have in common; and support
  /// as if independent.
  double joint = 0.0;
};

/// What a contact comes to.
struct ContactQuality {
  ContactEvents risk;
  /// Mean of the worst twentieth of what the surface is off the sole, m, at the worst
  /// place of it.
  double cvar_gap_m = 0.0;
  double contact_area_m2 = 0.0; ///< expected, ContactTolerances::contact_m
  /// Of the sole as it will lie: origin on the surface along the load, z out of it.
  Pose pose;
  /// Of (delta, c), R <- R Exp(delta), c in the axes of the surface's frame, rad and m.
  /// Of rank 1 with a stiff ankle, else 3: across the load the point is as planned.
  JetMatrix pose_covariance = JetMatrix::Zero();
};

struct ContactRisk {
  ContactStatus status = ContactStatus::InsufficientSupport;
  double support_share = 0.0; ///< of the sole, on surface that was seen
  /// Nothing without enough support: a quadric says nothing beyond where it was seen.
  std::optional<ContactQuality> quality;
};

/// \throw std::invalid_argument when foot or placement make no sense.
ContactRisk contactRisk(const ContactSurface& surface,
                        const Foot& foot,
                        const Placement& placement);

/// The same of a single patch, also where the fit is not usable: no support.
ContactRisk contactRisk(const FitResult& fit,
                        const Foot& foot,
                        const Placement& placement);

/// The same point and load with `yaws` directions of the sole, the first as placed,
/// over a full turn: the surface is worked out once. \param yaws at least 1.
std::vector<ContactRisk> contactRisks(const ContactSurface& surface,
                                      const Foot& foot,
                                      const Placement& placement,
                                      int yaws);

} // namespace holdfast
