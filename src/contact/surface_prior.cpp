#include <holdfast/contact/contact_risk.h>

#include <holdfast/geometry/gaussian.h>

#include <Eigen/Cholesky>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>

namespace holdfast {
namespace {

/// What kinds of surface differ in: [gx gy | kxx kxy kyy], the slope against the load
/// and the curvatures.
using Traits = Eigen::Matrix<double, 5, 1>;
using TraitsMatrix = Eigen::Matrix<double, 5, 5>;

/// Covariance of xx xy yy for second derivatives of variance one.
const Eigen::Matrix3d&
unitSecondDerivatives()
{
  // clang-format off
  static const Eigen::Matrix3d S = (Eigen::Matrix3d() <<
      1.0, 0.0, 1.0 / 3.0,
      0.0, 1.0 / 3.0, 0.0,
      1.0 / 3.0, 0.0, 1.0).finished();
  // clang-format on
  return S;
}

TraitsMatrix
covarianceOf(const SurfaceKind& kind)
{
  TraitsMatrix B = TraitsMatrix::Zero();
  B.topLeftCorner<2, 2>().setIdentity();
  B.topLeftCorner<2, 2>() *= kind.slope * kind.slope;
  B.bottomRightCorner<3, 3>() =
      kind.curvature_per_m * kind.curvature_per_m * unitSecondDerivatives();
  return B;
}

/// What a patch tells of its kind.
struct Evidence {
  Traits traits;
  Eigen::Matrix<double, 5, 6> by_jet;
  TraitsMatrix covariance;
  double chi2 = 0.0, chi2_expected = 0.0, chi2_per_roughness = 0.0;

  bool hasRoughness() const
  {
    return chi2_per_roughness > 0.0;
  }
  /// Squared roughness from the misfit, 1/m^4.
  double roughness(double noise_scale) const
  {
    return (chi2 - noise_scale * chi2_expected) / chi2_per_roughness;
  }
  /// The variance of that on a kind of surface: of chi-square, and of squares of four
  /// Gaussian numbers, some two thirds of their squared mean.
  double roughnessVariance(const SurfaceKind& kind) const
  {
    return 2.0 * std::max(chi2_expected, 1.0) /
               (chi2_per_roughness * chi2_per_roughness) +
           2.0 / 3.0 * std::pow(kind.s3_per_m2, 4);
  }
};

/// \return nothing where the patch does not face the load.
std::optional<Evidence>
evidenceOf(const MapPatch& patch, const Eigen::Vector3d& load_direction)
{
  if (patch.anchor.R.col(2).dot(load_direction) >= 0.0)
    return std::nullopt; // seen from the other side
  Placement placement;
  placement.load_direction = load_direction;
  placement.point = patch.anchor.c;
  const auto moved =
      movedJet(patch.jet.value(), patch.anchor.inverse() * loadFrame(placement));
  if (!moved || !moved->value.allFinite())
    return std::nullopt;
  Evidence e;
  e.traits << moved->value.segment<2>(1), patch.jet.value().tail<3>();
  e.by_jet << moved->by_jet.middleRows<2>(1), Eigen::Matrix3d::Zero(),
      Eigen::Matrix3d::Identity();
  e.covariance = e.by_jet * patch.jet.covariance() * e.by_jet.transpose();
  e.chi2 = patch.chi2;
  e.chi2_expected = patch.chi2_expected;
  e.chi2_per_roughness = patch.chi2_per_roughness;
  return e;
}

/// What a patch of a kind is expected to be.
struct Posterior {
  double log_likelihood = 0.0;
  Traits traits;
  TraitsMatrix covariance;
};

Posterior
posteriorOf(const Evidence& e, const SurfaceKind& kind, double noise_scale)
{
  const TraitsMatrix B = covarianceOf(kind);
  const Eigen::LLT<TraitsMatrix> S(B + e.covariance);
  const TraitsMatrix gain = S.solve(B).transpose();
  Posterior p;
  p.traits = gain * e.traits;
  p.covariance = B - gain * B;
  p.log_likelihood = -0.5 * e.traits.dot(S.solve(e.traits)) -
                     S.matrixLLT().diagonal().array().log().sum();
  if (e.hasRoughness()) {
    const double variance = e.roughnessVariance(kind);
    const double off = e.roughness(noise_scale) - kind.s3_per_m2 * kind.s3_per_m2;
    p.log_likelihood -= 0.5 * (off * off / variance + std::log(variance));
  }
  return p;
}

/// How likely each kind is, by a patch.
std::vector<double>
sharesOf(const std::vector<Posterior>& posteriors, const SurfacePrior& prior)
{
  double highest = posteriors.front().log_likelihood;
  for (const Posterior& p : posteriors)
    highest = std::max(highest, p.log_likelihood);
  std::vector<double> shares;
  double sum = 0.0;
  for (std::size_t c = 0; c < posteriors.size(); ++c) {
    shares.push_back(prior.kinds[c].share *
                     std::exp(posteriors[c].log_likelihood - highest));
    sum += shares.back();
  }
  for (double& share : shares)
    share /= sum;
  return shares;
}

std::vector<Posterior>
posteriorsOf(const Evidence& e, const SurfacePrior& prior)
{
  std::vector<Posterior> posteriors;
  for (const SurfaceKind& kind : prior.kinds)
    posteriors.push_back(posteriorOf(e, kind, prior.noise_scale));
  return posteriors;
}

/// Flatter is nothing that a camera tells.
constexpr double kLeastSlope = 1e-3, kLeastCurvature = 0.01;
/// Third derivatives that every surface is granted, 1/m^2, as PatchMapOptions does.
constexpr double kLeastRoughness = 10.0;
/// A misfit that the smoothest kind has everywhere is the noise's, up to what a
/// calibrated sensor may be off by; beyond that it counts as roughness, to be safe.
constexpr double kMostNoiseScale = 1.1;

/// Sums over patches by which a kind is estimated anew.
struct KindSums {
  double share = 0.0, squared_slope = 0.0, squared_curvature = 0.0;
  double chi2 = 0.0, chi2_expected = 0.0;
  double roughness = 0.0, weight = 0.0;

  /// \param kind, noise_scale as they were.
  void add(double share_of,
           const Evidence& e,
           const Posterior& p,
           const SurfaceKind& kind,
           double noise_scale)
  {
    const TraitsMatrix second = p.covariance + p.traits * p.traits.transpose();
    share += share_of;
    squared_slope += share_of * second.topLeftCorner<2, 2>().trace() / 2.0;
    const Eigen::Matrix3d curvatures = second.bottomRightCorner<3, 3>();
    squared_curvature +=
        share_of * unitSecondDerivatives().llt().solve(curvatures).trace() / 3.0;
    if (e.hasRoughness()) {
      const double w = share_of / e.roughnessVariance(kind);
      weight += w;
      roughness += w * e.roughness(noise_scale);
      chi2 += share_of * e.chi2;
      chi2_expected += share_of * e.chi2_expected;
    }
  }

  SurfaceKind kind(double patches) const
  {
    SurfaceKind kind;
    kind.share = std::max(1e-3, share / patches); // never impossible
    const double all = std::max(share, 1e-9);
    kind.slope = std::max(kLeastSlope, std::sqrt(squared_slope / all));
    kind.curvature_per_m =
        std::max(kLeastCurvature, std::sqrt(squared_curvature / all));
    const double squared = weight > 0.0 ? roughness / weight : 0.0;
    kind.s3_per_m2 = std::max(kLeastRoughness, std::sqrt(std::max(squared, 0.0)));
    return kind;
  }
};

void
improve(const std::vector<Evidence>& evidence, SurfacePrior& prior)
{
  std::vector<KindSums> sums(prior.kinds.size());
  for (const Evidence& e : evidence) {
    const std::vector<Posterior> posteriors = posteriorsOf(e, prior);
    const std::vector<double> shares = sharesOf(posteriors, prior);
    for (std::size_t c = 0; c < sums.size(); ++c)
      sums[c].add(shares[c], e, posteriors[c], prior.kinds[c], prior.noise_scale);
  }
  for (std::size_t c = 0; c < sums.size(); ++c)
    prior.kinds[c] = sums[c].kind(static_cast<double>(evidence.size()));
  const KindSums& smoothest = sums.front();
  prior.kinds.front().s3_per_m2 = kLeastRoughness;
  if (smoothest.chi2_expected > 0.0)
    prior.noise_scale = std::clamp(smoothest.chi2 / smoothest.chi2_expected,
                                   1.0 / kMostNoiseScale,
                                   kMostNoiseScale);
}

/// A thousand patches, spread over all, tell shares of kinds to a few per cent.
std::vector<Evidence>
evidenceOf(const std::vector<MapPatch>& patches, const Eigen::Vector3d& load_direction)
{
  constexpr std::size_t kMost = 1000;
  const std::size_t count = std::min(kMost, patches.size());
  std::vector<Evidence> evidence;
  for (std::size_t i = 0; i < count; ++i)
    if (const auto e = evidenceOf(patches[i * patches.size() / count], load_direction))
      evidence.push_back(*e);
  return evidence;
}

/// Mean and covariance over all hypotheses.
void
mixHypotheses(ContactSurface& surface)
{
  Jet mean;
  double sum = 0.0, squared_roughness = 0.0;
  for (const SurfaceHypothesis& h : surface.hypotheses)
    sum += h.share;
  for (SurfaceHypothesis& h : surface.hypotheses) {
    h.share /= sum;
    mean.value += h.share * h.jet.value;
    squared_roughness += h.share * h.s3_per_m2 * h.s3_per_m2;
  }
  for (const SurfaceHypothesis& h : surface.hypotheses) {
    const JetVector off = h.jet.value - mean.value;
    mean.white += h.share * (h.jet.white + off * off.transpose());
  }
  surface.jet = mean;
  surface.s3_per_m2 = std::sqrt(squared_roughness);
}

} // namespace

SurfacePrior
surfacePriorOf(const PatchMap& map, const Eigen::Vector3d& load_direction)
{
  constexpr std::size_t kFewest = 30;
  SurfacePrior prior;
  prior.load_direction = load_direction;
  const std::vector<Evidence> evidence = evidenceOf(map.patches(), load_direction);
  if (evidence.size() < kFewest)
    return prior;
  // From level ground to edges; where it starts decides which kind is which, no more.
  prior.kinds = {{0.4, 0.03, 0.3, 10.0},
                 {0.3, 0.1, 1.0, 30.0},
                 {0.2, 0.3, 5.0, 100.0},
                 {0.1, 0.3, 15.0, 300.0}};
  for (int i = 0; i < 30; ++i) // shares follow by a per cent after that
    improve(evidence, prior);
  return prior;
}

ContactSurface
contactSurfaceOf(const PatchMap& map, const MapPatch& patch, const SurfacePrior& prior)
{
  ContactSurface surface;
  surface.anchor = patch.anchor;
  surface.support = patch.support;
  surface.radius_m = patch.radius_m;
  surface.jet = {patch.jet.value(), patch.jet.covariance(), JetMatrix::Zero()};
  surface.s3_per_m2 = map.roughnessOf(patch);
  const auto evidence =
      prior.kinds.empty() ? std::nullopt : evidenceOf(patch, prior.load_direction);
  if (!evidence)
    return surface;

  const std::vector<Posterior> posteriors = posteriorsOf(*evidence, prior);
  const std::vector<double> shares = sharesOf(posteriors, prior);
  // How the jet follows its traits.
  const JetMatrix P = surface.jet.white;
  const Eigen::Matrix<double, 6, 5> follow =
      evidence->covariance.llt()
          .solve(Eigen::Matrix<double, 5, 6>(evidence->by_jet * P))
          .transpose();
  for (std::size_t c = 0; c < shares.size(); ++c) {
    constexpr double kUnlikely = 0.01;
    if (shares[c] < kUnlikely)
      continue;
    SurfaceHypothesis h;
    h.share = shares[c];
    h.jet.value =
        surface.jet.value + follow * (posteriors[c].traits - evidence->traits);
    h.jet.white = symmetrized(
        JetMatrix(P - follow * (evidence->covariance - posteriors[c].covariance) *
                          follow.transpose()));
    h.s3_per_m2 = prior.kinds[c].s3_per_m2;
    surface.hypotheses.push_back(h);
  }
  mixHypotheses(surface);
  return surface;
}

} // namespace holdfast
