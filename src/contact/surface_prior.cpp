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

/// What kinds of surface differ in: [gx gy | u v w], the slope against the load and the
/// curvatures xx xy yy in coordinates in which those of a kind are independent and of
/// one variance.
using Traits = Eigen::Matrix<double, 5, 1>;
using TraitsMatrix = Eigen::Matrix<double, 5, 5>;

/// [u v w] of xx xy yy: the inverse root of their covariance for second derivatives of
/// variance one, [1 0 1/3; 0 1/3 0; 1/3 0 1].
const Eigen::Matrix3d&
independentCurvatures()
{
  static const Eigen::Matrix3d T = [] {
    Eigen::Matrix3d S;
    S << 1.0, 0.0, 1.0 / 3.0, 0.0, 1.0 / 3.0, 0.0, 1.0 / 3.0, 0.0, 1.0;
    return Eigen::Matrix3d(S.llt().matrixL().solve(Eigen::Matrix3d::Identity()));
  }();
  return T;
}

/// Of the traits of a kind, which are independent.
Traits
variancesOf(const SurfaceKind& kind)
{
  const double slope = kind.slope * kind.slope;
  const double curvature = kind.curvature_per_m * kind.curvature_per_m;
  return (Traits() << slope, slope, curvature, curvature, curvature).finished();
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
    const double squared = kind.s3_per_m2 * kind.s3_per_m2;
    return 2.0 * std::max(chi2_expected, 1.0) /
               (chi2_per_roughness * chi2_per_roughness) +
           2.0 / 3.0 * squared * squared;
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
  const Eigen::Matrix3d& T = independentCurvatures();
  e.traits << moved->value.segment<2>(1), T * patch.jet.value().tail<3>();
  e.by_jet << moved->by_jet.middleRows<2>(1), Eigen::Matrix3d::Zero(), T;
  e.covariance = e.by_jet * patch.jet.covariance() * e.by_jet.transpose();
  e.chi2 = patch.chi2;
  e.chi2_expected = patch.chi2_expected;
  e.chi2_per_roughness = patch.chi2_per_roughness;
  return e;
}

/// L^-1 of a positive definite S = L L^T. Every patch is weighed against every kind
/// dozens of times: a general factorization takes several times as long.
TraitsMatrix
inverseRoot(const TraitsMatrix& S)
{
  constexpr int n = TraitsMatrix::RowsAtCompileTime;
  TraitsMatrix L = TraitsMatrix::Zero(), inverse = TraitsMatrix::Zero();
  for (int j = 0; j < n; ++j) {
    double pivot = S(j, j);
    for (int k = 0; k < j; ++k)
      pivot -= L(j, k) * L(j, k);
    inverse(j, j) = 1.0 / std::sqrt(pivot);
    for (int i = j + 1; i < n; ++i) {
      double sum = S(i, j);
      for (int k = 0; k < j; ++k)
        sum -= L(i, k) * L(j, k);
      L(i, j) = sum * inverse(j, j);
    }
    for (int c = 0; c < j; ++c) { // row j of L L^-1 = I
      double sum = 0.0;
      for (int k = c; k < j; ++k)
        sum += L(j, k) * inverse(k, c);
      inverse(j, c) = -sum * inverse(j, j);
    }
  }
  return inverse;
}

/// What a patch of a kind is expected to be.
struct Posterior {
  double log_likelihood = 0.0;
  Traits prior; ///< variances of the kind
  TraitsMatrix inverse_root; ///< of the covariance with which traits are measured
  Traits traits;

  /// prior - prior S^-1 prior, its diagonal.
  Traits variances() const
  {
    const Traits squared = inverse_root.colwise().squaredNorm().transpose();
    return prior - prior.cwiseProduct(prior).cwiseProduct(squared);
  }
  TraitsMatrix covariance() const
  {
    const TraitsMatrix known = inverse_root * prior.asDiagonal();
    return TraitsMatrix(prior.asDiagonal()) - known.transpose() * known;
  }
};

Posterior
posteriorOf(const Evidence& e, const SurfaceKind& kind, double noise_scale)
{
  Posterior p;
  p.prior = variancesOf(kind);
  TraitsMatrix S = e.covariance;
  S.diagonal() += p.prior;
  p.inverse_root = inverseRoot(S);
  const Traits normal = p.inverse_root * e.traits;
  p.traits = p.prior.cwiseProduct(p.inverse_root.transpose() * normal);
  p.log_likelihood =
      std::log(p.inverse_root.diagonal().prod()) - 0.5 * normal.squaredNorm();
  if (e.hasRoughness()) {
    const double variance = e.roughnessVariance(kind);
    const double off = e.roughness(noise_scale) - kind.s3_per_m2 * kind.s3_per_m2;
    p.log_likelihood -= 0.5 * (off * off / variance + std::log(variance));
  }
  return p;
}

void
posteriorsOf(const Evidence& e,
             const SurfacePrior& prior,
             std::vector<Posterior>& posteriors)
{
  posteriors.clear();
  for (const SurfaceKind& kind : prior.kinds)
    posteriors.push_back(posteriorOf(e, kind, prior.noise_scale));
}

/// How likely each kind is, by a patch.
void
sharesOf(const std::vector<Posterior>& posteriors,
         const SurfacePrior& prior,
         std::vector<double>& shares)
{
  double highest = posteriors.front().log_likelihood;
  for (const Posterior& p : posteriors)
    highest = std::max(highest, p.log_likelihood);
  shares.clear();
  double sum = 0.0;
  for (std::size_t c = 0; c < posteriors.size(); ++c) {
    shares.push_back(prior.kinds[c].share *
                     std::exp(posteriors[c].log_likelihood - highest));
    sum += shares.back();
  }
  for (double& share : shares)
    share /= sum;
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
    const Traits squares = p.variances() + p.traits.cwiseProduct(p.traits);
    share += share_of;
    squared_slope += share_of * squares.head<2>().mean();
    squared_curvature += share_of * squares.tail<3>().mean();
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
  std::vector<Posterior> posteriors;
  std::vector<double> shares;
  for (const Evidence& e : evidence) {
    posteriorsOf(e, prior, posteriors);
    sharesOf(posteriors, prior, shares);
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

  std::vector<Posterior> posteriors;
  std::vector<double> shares;
  posteriorsOf(*evidence, prior, posteriors);
  sharesOf(posteriors, prior, shares);
  // How the jet follows its traits.
  const JetMatrix P = surface.jet.white;
  const Eigen::Matrix<double, 6, 5> follow =
      evidence->covariance.llt()
          .solve(Eigen::Matrix<double, 5, 6>(evidence->by_jet * P))
          .transpose();
  for (std::size_t c = 0; c < shares.size(); ++c) {
    if (shares[c] < kUnlikelyKind)
      continue;
    SurfaceHypothesis h;
    h.share = shares[c];
    h.jet.value =
        surface.jet.value + follow * (posteriors[c].traits - evidence->traits);
    h.jet.white = symmetrized(
        JetMatrix(P - follow * (evidence->covariance - posteriors[c].covariance()) *
                          follow.transpose()));
    h.s3_per_m2 = prior.kinds[c].s3_per_m2;
    surface.hypotheses.push_back(h);
  }
  mixHypotheses(surface);
  return surface;
}

} // namespace holdfast
