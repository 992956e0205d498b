#include <holdfast/contact/contact_risk.h>

#include <holdfast/geometry/gaussian.h>

#include <Eigen/Cholesky>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

namespace holdfast {
namespace {

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

/// What a patch tells of its kind.
struct Evidence {
  Eigen::Vector3d curvature;
  Eigen::Matrix3d covariance; ///< of the curvature
  /// Squared roughness from its misfit, 1/m^4, and the variance of that where the
  /// surface is a quadric; infinite where it tells nothing.
  double roughness = 0.0;
  double roughness_variance = std::numeric_limits<double>::infinity();

  explicit Evidence(const MapPatch& patch)
  : curvature(patch.jet.value().tail<3>())
  , covariance(patch.jet.covariance().bottomRightCorner<3, 3>())
  {
    if (!(patch.chi2_per_roughness > 0.0))
      return;
    const double w = patch.chi2_per_roughness;
    roughness = (patch.chi2 - patch.chi2_expected) / w;
    roughness_variance = 2.0 * std::max(patch.chi2_expected, 1.0) / (w * w);
  }

  /// The variance of `roughness` on a kind of surface, where squares of four Gaussian
  /// numbers scatter, too: by some two thirds of their squared mean.
  double varianceOn(const SurfaceKind& kind) const
  {
    return roughness_variance + 2.0 / 3.0 * std::pow(kind.s3_per_m2, 4);
  }
};

/// What a patch of a kind is expected to be.
struct Posterior {
  double log_likelihood = 0.0;
  Eigen::Vector3d curvature;
  Eigen::Matrix3d covariance;
};

Posterior
posteriorOf(const Evidence& e, const SurfaceKind& kind)
{
  const Eigen::Matrix3d B =
      kind.curvature_per_m * kind.curvature_per_m * unitSecondDerivatives();
  const Eigen::LLT<Eigen::Matrix3d> S(B + e.covariance);
  const Eigen::Matrix3d gain = S.solve(B).transpose();
  Posterior p;
  p.curvature = gain * e.curvature;
  p.covariance = B - gain * B;
  p.log_likelihood = -0.5 * e.curvature.dot(S.solve(e.curvature)) -
                     S.matrixLLT().diagonal().array().log().sum();
  if (std::isfinite(e.roughness_variance)) {
    const double variance = e.varianceOn(kind);
    const double off = e.roughness - kind.s3_per_m2 * kind.s3_per_m2;
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
    posteriors.push_back(posteriorOf(e, kind));
  return posteriors;
}

/// Flatter, and more of a quadric, is nothing that a camera tells.
constexpr double kLeastCurvature = 0.01, kLeastRoughness = 1.0;

/// Sums over patches by which a kind is estimated anew.
struct KindSums {
  double share = 0.0, squared_curvature = 0.0, roughness = 0.0, weight = 0.0;

  void add(double share_of, const Evidence& e, const Posterior& p, const SurfaceKind& k)
  {
    const Eigen::Matrix3d second = p.covariance + p.curvature * p.curvature.transpose();
    share += share_of;
    squared_curvature +=
        share_of * unitSecondDerivatives().llt().solve(second).trace() / 3.0;
    if (std::isfinite(e.roughness_variance)) {
      const double w = share_of / e.varianceOn(k);
      weight += w;
      roughness += w * e.roughness;
    }
  }

  SurfaceKind kind(double patches) const
  {
    SurfaceKind kind;
    kind.share = std::max(1e-3, share / patches); // never impossible
    kind.curvature_per_m =
        std::max(kLeastCurvature, std::sqrt(squared_curvature / std::max(share, 1e-9)));
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
      sums[c].add(shares[c], e, posteriors[c], prior.kinds[c]);
  }
  for (std::size_t c = 0; c < sums.size(); ++c)
    prior.kinds[c] = sums[c].kind(static_cast<double>(evidence.size()));
}

/// A thousand patches, spread over all, tell shares of kinds to a few per cent.
std::vector<Evidence>
evidenceOf(const std::vector<MapPatch>& patches)
{
  constexpr std::size_t kMost = 1000;
  const std::size_t count = std::min(kMost, patches.size());
  std::vector<Evidence> evidence;
  for (std::size_t i = 0; i < count; ++i)
    evidence.emplace_back(patches[i * patches.size() / count]);
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
surfacePriorOf(const PatchMap& map)
{
  constexpr std::size_t kFewest = 30;
  SurfacePrior prior;
  if (map.patches().size() < kFewest)
    return prior;
  prior.kinds = {{0.5, 0.3, 10.0}, {0.3, 3.0, 30.0}, {0.2, 10.0, 200.0}};
  const std::vector<Evidence> evidence = evidenceOf(map.patches());
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
  if (prior.kinds.empty())
    return surface;

  const Evidence evidence(patch);
  const std::vector<Posterior> posteriors = posteriorsOf(evidence, prior);
  const std::vector<double> shares = sharesOf(posteriors, prior);
  // The rest of the jet follows its curvatures.
  const JetMatrix P = surface.jet.white;
  const Eigen::Matrix<double, 6, 3> follow =
      evidence.covariance.llt().solve(P.bottomRows<3>()).transpose();
  for (std::size_t c = 0; c < shares.size(); ++c) {
    constexpr double kUnlikely = 0.01;
    if (shares[c] < kUnlikely)
      continue;
    SurfaceHypothesis h;
    h.share = shares[c];
    h.jet.value =
        surface.jet.value + follow * (posteriors[c].curvature - evidence.curvature);
    h.jet.white = symmetrized(
        JetMatrix(P - follow * (evidence.covariance - posteriors[c].covariance) *
                          follow.transpose()));
    h.s3_per_m2 = prior.kinds[c].s3_per_m2;
    surface.hypotheses.push_back(h);
  }
  mixHypotheses(surface);
  return surface;
}

} // namespace holdfast
