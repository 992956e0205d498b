#include "fusion_trials.h"

#include <holdfast/evaluation/spot_view.h>
#include <holdfast/geometry/rotation.h>
#include <holdfast/patch_estimator.h>

#include <algorithm>
#include <optional>

namespace holdfast::app {
namespace {

constexpr double kRadius = 0.05;
constexpr int kStride = 4; // some 140 points

/// Of a pose that is known far better than anything is measured.
JetMatrix
negligible()
{
  return 1e-18 * JetMatrix::Identity();
}

/// Where the sensor is, and where it believes to be.
class Travel {
public:
  Travel(const Pose& start, double sigma_rad, double sigma_m)
  : pose_(start), believed_(start), covariance_(negligible())
  {
    JetVector variance;
    variance << Eigen::Vector3d::Constant(sigma_rad * sigma_rad),
        Eigen::Vector3d::Constant(sigma_m * sigma_m);
    step_covariance_ = variance.asDiagonal();
  }

  void goTo(const Pose& pose, std::mt19937_64& generator)
  {
    const JetVector sigma = step_covariance_.diagonal().cwiseSqrt();
    increment_ = pose_.inverse() * pose;
    increment_.R *= expMap(sigma[0] * normalVector(generator));
    increment_.c += sigma[3] * normalVector(generator);
    pose_ = pose;
    // delta in the axes of the new frame, c in those of the world.
    JetMatrix A = JetMatrix::Identity();
    A.topLeftCorner<3, 3>() = increment_.R.transpose();
    A.bottomLeftCorner<3, 3>() = -believed_.R * skew(increment_.c);
    covariance_ = A * covariance_ * A.transpose() + step_covariance_;
    believed_ = believed_ * increment_;
  }

  const Pose& pose() const
  {
    return pose_;
  }

  /// Tells a map what it is to know.
  /// \param is_first nothing has moved yet
  void tell(PoseSource source, bool is_first, PatchMap& map) const
  {
    if (source == PoseSource::Still)
      return;
    if (is_first || source == PoseSource::Known)
      map.place(pose_, negligible());
    else if (source == PoseSource::OdometryWorld)
      map.place(believed_, covariance_);
    else
      map.move(increment_,
               source == PoseSource::Odometry ? step_covariance_ : negligible());
  }

private:
  Pose pose_, believed_;
  Pose increment_; ///< believed
  JetMatrix covariance_, step_covariance_;
};

std::optional<SpotError>
errorOf(const PatchMap& map, PoseSource source, const Pose& sensor, const Scene& scene)
{
  if (map.patches().empty())
    return std::nullopt;
  const MapPatch& patch = map.patches().front();
  // Robot-centric maps say where it is from the sensor, others where in the world.
  const Pose anchor = source == PoseSource::OdometryWorld ?
                          patch.anchor :
                          sensor * (map.pose().inverse() * patch.anchor);
  const auto truth = trueJet(scene, anchor, patch.radius_m);
  if (!truth)
    return std::nullopt;
  const JetMatrix P = patch.jet.covariance();
  return SpotError{squaredInSigmas(patch.jet.value() - *truth, P), P(0, 0)};
}

/// The measurement as one would have it who takes every surface for a quadric.
Measurement
withoutModelError(Measurement m)
{
  m.design.chi2_per_roughness = 0.0;
  return m;
}

PatchMapOptions
optionsOf(const FusionRule& rule)
{
  PatchMapOptions options = rule.map;
  options.radius_m = kRadius;
  // All views are of one patch.
  options.max_tilt_rad = 1.0;
  options.association_radius = 1.0;
  // What a gate refuses is counted, and nothing begins anew.
  options.conflicts_to_replace = 1 << 20;
  if (!rule.model_error)
    options.s3_floor_per_m2 = 1e-6;
  return options;
}

/// One spot and all who look at it.
class SpotTrial {
public:
  SpotTrial(const FusionCase& c, std::mt19937_64& generator)
  : case_(c)
  , is_still_(c.rules.front().poses == PoseSource::Still)
  , generator_(generator)
  , estimator_(fusedFitOptions())
  , sensor_(independentKinect())
  , scene_(curvedSpot(c.s3_per_m2, generator))
  , travel_(viewOfSpot(generator), c.odometry_sigma_rad, c.odometry_sigma_m)
  {
    sensor_.pattern = c.pattern;
    for (const FusionRule& rule : c.rules)
      maps_.emplace_back(optionsOf(rule));
    outcomes_.resize(c.rules.size());
    look(0.0);
  }

  std::vector<RuleOutcome> run()
  {
    for (int view = 1; view <= case_.views.back(); ++view) {
      if (view > 1 && !is_still_) {
        travel_.goTo(viewOfSpot(generator_), generator_);
        look(case_.offset_m);
      }
      const auto m = seen_->measure(estimator_, generator_);
      const bool is_asked =
          std::find(case_.views.begin(), case_.views.end(), view) != case_.views.end();
      for (std::size_t i = 0; i < maps_.size(); ++i) {
        update(i, view == 1, m);
        if (is_asked)
          outcomes_[i].errors.push_back(
              errorOf(maps_[i], case_.rules[i].poses, travel_.pose(), scene_));
      }
    }
    return outcomes_;
  }

private:
  void look(double offset_m)
  {
    const Pose disc = discNearSpot(offset_m, generator_);
    seen_.emplace(scene_, sensor_, travel_.pose(), disc, kRadius, kStride);
    seen_->drawPattern(generator_);
  }

  void update(std::size_t i, bool is_first, const std::optional<Measurement>& m)
  {
    const FusionRule& rule = case_.rules[i];
    travel_.tell(rule.poses, is_first, maps_[i]);
    if (!m)
      return;
    const UpdateReport report =
        maps_[i].update({rule.model_error ? *m : withoutModelError(*m)});
    ++outcomes_[i].measured;
    outcomes_[i].refused += report.gated;
  }

  const FusionCase& case_;
  bool is_still_;
  std::mt19937_64& generator_;
  PatchEstimator estimator_;
  Sensor sensor_;
  Scene scene_;
  Travel travel_;
  std::vector<PatchMap> maps_;
  std::optional<SpotView> seen_;
  std::vector<RuleOutcome> outcomes_;
};

} // namespace

std::vector<RuleOutcome>
fuseViews(const FusionCase& c, std::mt19937_64& generator)
{
  return SpotTrial(c, generator).run();
}

} // namespace holdfast::app
