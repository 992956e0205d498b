#include "sac_doubts.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

namespace holdfast {
namespace {

// A threshold of so few sigmas keeps 38 % of a surface, one of so many all and clutter.
constexpr double kFewestSigmas = 0.5, kMostSigmas = 30.0;
constexpr double kMostNoises = 100.0; // of a threshold in metres
constexpr double kMostOfExtent = 0.25;
constexpr double kLeastOfSpacing = 1.0 / 30.0;
constexpr double kLeastMetresThatAreSigmas = 1.0;
// No depth camera sees as wide and as far.
constexpr double kWidestImage = 100.0, kFarthestImage = 60.0; // m

using Doubts = std::vector<std::string>;

std::string
metres(double value)
{
  return shortNumber(value) + " m";
}

bool
inSigmas(const ConsensusFacts& facts)
{
  return facts.unit == ConsensusDistance::Mahalanobis;
}

std::string
thresholdText(const ConsensusFacts& facts)
{
  return shortNumber(facts.limits.threshold) + (inSigmas(facts) ? " sigmas" : " m");
}

std::string
doubtSigmas(const ConsensusFacts& facts)
{
  const double threshold = facts.limits.threshold;
  const std::string given = "a threshold of " + thresholdText(facts);
  if (threshold < kFewestSigmas)
    return fmt::format("{} keeps {} % of the points of a surface: 2 to 5 sigmas are "
                       "expected; is it in metres (setDistanceThreshold(), "
                       "ConsensusDistance::Euclidean)?",
                       given,
                       shortNumber(100.0 * std::erf(threshold / std::sqrt(2.0))));
  if (threshold > kMostSigmas)
    return fmt::format("{}{}: 2 to 5 sigmas are expected; is it in millimetres?",
                       given,
                       facts.noise_m > 0.0 ?
                           " is " + metres(threshold * facts.noise_m) :
                           std::string());
  return {};
}

// Of thresholds in metres where the noise is known, and where it is not.
std::string
doubtBesideNoise(const ConsensusFacts& facts)
{
  const double threshold = facts.limits.threshold;
  const std::string given = "a threshold of " + thresholdText(facts);
  if (threshold < facts.noise_m)
    return fmt::format("{} is below the noise of the points, {}: it misses most points "
                       "of a surface; 2 to 5 times the noise are expected, or sigmas "
                       "(setSigmaThreshold(), ConsensusDistance::Mahalanobis)",
                       given,
                       metres(facts.noise_m));
  if (facts.noise_m > 0.0 && threshold > kMostNoises * facts.noise_m)
    return fmt::format("{} is {} times the noise of the points: 2 to 5 times are "
                       "expected; is it in sigmas (setSigmaThreshold(), "
                       "ConsensusDistance::Mahalanobis)?",
                       given,
                       shortNumber(threshold / facts.noise_m));
  return {};
}

std::string
doubtWithoutNoise(const ConsensusFacts& facts)
{
  const double threshold = facts.limits.threshold;
  if (facts.for_want_of_noise && threshold >= kLeastMetresThatAreSigmas)
    return fmt::format("a threshold of {} is read as metres, because nothing is known "
                       "of the noise: for sigmas, give a sensor, a noise model or "
                       "covariances",
                       shortNumber(threshold));
  if (threshold < kLeastOfSpacing * facts.cloud.spacing_m)
    return fmt::format("a threshold of {} is far below the distance between points, "
                       "{}: metres are expected; is the cloud in millimetres?",
                       metres(threshold),
                       metres(facts.cloud.spacing_m));
  return {};
}

std::string
doubtMetres(const ConsensusFacts& facts)
{
  const double threshold = facts.limits.threshold;
  const double extent = facts.cloud.extent();
  std::string doubt =
      facts.noise_known ? doubtBesideNoise(facts) : doubtWithoutNoise(facts);
  if (doubt.empty() && extent > 0.0 && threshold > kMostOfExtent * extent)
    doubt = fmt::format("a threshold of {} is more than a quarter of the cloud's "
                        "extent, {}: metres are expected; is it in sigmas "
                        "(setSigmaThreshold(), ConsensusDistance::Mahalanobis) or in "
                        "millimetres?",
                        metres(threshold),
                        metres(extent));
  return doubt;
}

std::string
doubtThreshold(const ConsensusFacts& facts)
{
  if (!(facts.limits.threshold > 0.0))
    return "a threshold of " + thresholdText(facts) + " keeps no point";
  return inSigmas(facts) ? doubtSigmas(facts) : doubtMetres(facts);
}

std::string
radiiText(const ConsensusLimits& limits)
{
  const ConsensusLimits all;
  const bool no_most = limits.radius_max_m == all.radius_max_m;
  return fmt::format("{} to {}",
                     metres(std::max(limits.radius_min_m, 0.0)),
                     no_most ? "any" : metres(limits.radius_max_m));
}

std::string
doubtRadii(const ConsensusFacts& facts)
{
  const ConsensusLimits& limits = facts.limits;
  if (!facts.curved)
    return {};
  if (!(limits.radius_min_m <= limits.radius_max_m && limits.radius_max_m > 0.0))
    return "radius limits of " + radiiText(limits) + " leave no radius";
  if (limits.radius_max_m < facts.cloud.spacing_m)
    return fmt::format("the largest radius, {}, is below the distance between points, "
                       "{}: metres are expected; is the cloud in millimetres?",
                       metres(limits.radius_max_m),
                       metres(facts.cloud.spacing_m));
  if (limits.radius_min_m > facts.cloud.extent())
    return fmt::format("the least radius, {}, is larger than the cloud, {}: metres are "
                       "expected; is it in millimetres?",
                       metres(limits.radius_min_m),
                       metres(facts.cloud.extent()));
  return {};
}

std::string
doubtUnit(const ConsensusFacts& facts)
{
  const CloudMeasure& cloud = facts.cloud;
  if (cloud.organized && cloud.extent() > kWidestImage &&
      cloud.range_m > kFarthestImage)
    return fmt::format("the image is {} wide and {} away: metres are expected; is the "
                       "cloud in millimetres?",
                       metres(cloud.extent()),
                       metres(cloud.range_m));
  return {};
}

std::string
doubtNoise(const ConsensusFacts& facts)
{
  if (!facts.noise_known)
    return {};
  if (std::isnan(facts.noise_m))
    return "no point has a usable covariance: are the points in front of the sensor "
           "(setSensorPose()), are the covariances positive?";
  const double extent = facts.cloud.extent();
  if (extent > 0.0 && facts.noise_m > kMostOfExtent * extent)
    return fmt::format("the noise of the points, {}, is as large as the cloud, {}: "
                       "metres are expected; is the cloud in millimetres, is it the "
                       "right sensor?",
                       metres(facts.noise_m),
                       metres(extent));
  return {};
}

} // namespace

Doubts
doubtsAbout(const ConsensusFacts& facts)
{
  if (facts.cloud.valid == 0)
    return {fmt::format("none of the {} points is finite", facts.cloud.points)};
  // The more likely cause first.
  Doubts doubts{doubtUnit(facts),
                doubtNoise(facts),
                doubtThreshold(facts),
                doubtRadii(facts)};
  doubts.erase(std::remove(doubts.begin(), doubts.end(), std::string()), doubts.end());
  return doubts;
}

std::string
whyNothing(const ConsensusFacts& facts)
{
  std::string text = "no patch: " + describe(facts.cloud);
  if (std::isfinite(facts.noise_m) && facts.noise_known)
    text += ", noise " + metres(facts.noise_m);
  text += "; threshold " + thresholdText(facts);
  const ConsensusLimits all;
  if (facts.curved && (facts.limits.radius_min_m != all.radius_min_m ||
                       facts.limits.radius_max_m != all.radius_max_m))
    text += ", radius " + radiiText(facts.limits);
  const Doubts doubts = doubtsAbout(facts);
  return text + "; likely cause: " +
         (doubts.empty() ? "there is no such surface within the threshold, or too few "
                           "iterations to meet it" :
                           doubts.front());
}

} // namespace holdfast
