#include "extraction_advice.h"

#include "cloud_measure.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace holdfast {
namespace {

/// A surface needs this many points at least.
constexpr std::size_t kFewestPoints = 3;

/// Seeds that are tried first: few against all, and enough that a cloud in which one in
/// ten seeds has neighbours is stopped once in a thousand times only.
constexpr std::size_t kProbes = 64;
constexpr std::size_t kWorthProbing = 4 * kProbes;

/// Where the neighbourhoods of most seeds have so much of the cloud, the radius may be
/// larger than that. (Surfaces, jumps and lone pixels leave something out.)
constexpr double kMuch = 0.25;

/// The unit in which the cloud would be like those of depth cameras: of the size of a
/// room, with points some millimetres apart; empty when it is so already.
std::string
likelyUnit(const CloudMeasure& measure)
{
  struct Unit {
    double scale;
    const char* option;
  };
  constexpr std::array<Unit, 3> kUnits{{{1e-3, "mm"}, {1e-2, "cm"}, {1e-6, "um"}}};
  constexpr double kSpacing = 3e-3, kExtent = 3.0; // of a room before a camera, m
  const auto plausible = [&measure](double scale) {
    const double spacing = scale * measure.spacing_m;
    const double extent = scale * measure.extent();
    return spacing >= 2e-4 && spacing <= 0.03 && extent >= 0.05 && extent <= 30.0;
  };
  const auto strangeness = [&measure](double scale) {
    return std::abs(std::log(scale * measure.spacing_m / kSpacing)) +
           std::abs(std::log(scale * measure.extent() / kExtent));
  };
  if (plausible(1.0))
    return {};
  const Unit* likeliest = nullptr;
  for (const Unit& unit : kUnits)
    if (plausible(unit.scale) &&
        (likeliest == nullptr ||
         strangeness(unit.scale) < strangeness(likeliest->scale)))
      likeliest = &unit;
  return likeliest == nullptr ? "" : likeliest->option;
}

std::string
meters(double length)
{
  return shortNumber(length) + " m";
}

/// What is wrong with neighbourhoods of this radius in this cloud; empty if nothing is.
std::string
radiusAdvice(const CloudMeasure& measure, double radius_m)
{
  const std::string unit = likelyUnit(measure);
  if (!unit.empty())
    return fmt::format("are the coordinates not metres? --unit {} scales them", unit);
  if (radius_m >= measure.extent())
    return fmt::format("the radius of {} is larger than the cloud", meters(radius_m));
  // A disc of two spacings holds a dozen points.
  if (!(radius_m >= 2.0 * measure.spacing_m))
    return fmt::format("the radius of {} is too small for points so far apart, or the "
                       "unit is not the metre (--unit)",
                       meters(radius_m));
  return {};
}

/// Every n-th seed, kProbes of them.
std::vector<Seed>
probesAmong(const std::vector<Seed>& seeds)
{
  std::vector<Seed> probes;
  for (std::size_t i = 0; i < kProbes; ++i)
    probes.push_back(seeds[i * seeds.size() / kProbes]);
  return probes;
}

/// The cloud, and what is wrong where something is.
std::string
described(const CloudMeasure& measure, const std::string& advice)
{
  return describe(measure) + (advice.empty() ? "" : ": " + advice);
}

CloudMeasure
measured(const PointSelection& chosen)
{
  return measureCloud(*chosen.cloud.points, chosen.cloud.sensor_pose.c);
}

} // namespace

std::string
fallbackNotice(const NeighborhoodSampler& sampler, const RangeCloud& cloud)
{
  const bool disc = sampler.options().neighborhood == Neighborhood::Disc;
  const bool patch = sampler.options().neighborhood == Neighborhood::Patch;
  const bool organized = cloud.points->height > 1;
  if (sampler.usesPixels() || !(disc || (patch && organized)))
    return {};
  if (!organized)
    return "not organized: balls take the place of discs";
  const std::string place =
      disc ? "balls take the place of discs" : "patches are not cut at jumps of depth";
  return "organized, but rows and columns are not the pixels of a camera at the "
         "sensor's pose (mirrored, turned, or scanned all round?): " +
         place;
}

std::string
viewpointNotice(const RangeCloud& cloud)
{
  const Eigen::Vector3d c = cloud.sensor_pose.c + cloud.offset; // in the file
  return fmt::format(
      "it is not known where the cloud was taken from, and the points do "
      "not look as if it were {} {} {}: normals may be on the wrong side "
      "(bumps come out as bowls); --viewpoint X Y Z or --orient "
      "outward|up tells the side",
      shortNumber(c.x()),
      shortNumber(c.y()),
      shortNumber(c.z()));
}

void
keepPromisingSeeds(const PointSelection& chosen,
                   const SamplerOptions& sampler,
                   const NeighborhoodSearch& search,
                   std::vector<Seed>& seeds,
                   std::vector<std::string>& notices)
{
  if (seeds.size() < kWorthProbing || sampler.neighborhood == Neighborhood::Knn)
    return;
  const std::vector<Seed> probes = probesAmong(seeds);
  const auto whole = static_cast<double>(chosen.points.used);
  std::size_t with_neighbors = 0;
  std::size_t with_much = 0;
  std::vector<int> indices;
  for (const Seed& seed : probes) {
    search(seed, 0, indices);
    with_neighbors += indices.size() >= kFewestPoints;
    with_much += static_cast<double>(indices.size()) > kMuch * whole;
  }
  if (with_neighbors <= 1) {
    const CloudMeasure measure = measured(chosen);
    notices.push_back(
        fmt::format("{} of {} seeds have neighbours, the other {} are not tried: {}",
                    with_neighbors,
                    probes.size(),
                    seeds.size() - probes.size(),
                    described(measure, radiusAdvice(measure, sampler.radius_m))));
    seeds = probes;
  }
  else if (2 * with_much > probes.size()) {
    const CloudMeasure measure = measured(chosen);
    if (sampler.radius_m < measure.extent())
      return;
    notices.push_back(fmt::format("only one seed is tried, since the radius of {} is "
                                  "larger than the cloud, {}",
                                  meters(sampler.radius_m),
                                  describe(measure)));
    seeds = {probes[probes.size() / 2]};
  }
}

void
adviseOnNoPatches(const PointSelection& chosen,
                  const SamplerOptions& sampler,
                  ExtractionResult& result)
{
  if (std::any_of(result.patches.begin(), result.patches.end(), isAccepted))
    return;
  if (chosen.points.used == 0) {
    const std::string left_out = leftOutText(chosen.points);
    result.notices.push_back(
        fmt::format("no patch, since no point can be used: {} of {} are invalid{}",
                    chosen.points.invalid,
                    chosen.points.in_cloud,
                    left_out.empty() ? "" : ", " + left_out));
    return;
  }
  const CloudMeasure measure = measured(chosen);
  const std::string advice = sampler.neighborhood == Neighborhood::Knn ?
                                 std::string() :
                                 radiusAdvice(measure, sampler.radius_m);
  result.notices.push_back("no patch: " + described(measure, advice));
}

} // namespace holdfast
