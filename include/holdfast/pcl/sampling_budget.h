/// \file When sampling has gone on for long enough.
#pragma once

#include <holdfast/pcl/neighborhood_sampler.h>

#include <chrono>
#include <vector>

namespace holdfast {

/// True when the options limit area or time.
bool isLimited(const SamplerOptions& options);

/// Watches the limits of area and time while the neighbourhoods of a cloud are visited:
///
///     SamplingBudget budget(sampler.options(), cloud.points->size());
///     for (int seed : sampler.seeds()) {
///       if (budget.isSpent())
///         break;
///       sampler.neighborhood(seed, *scratch, indices);
///       budget.cover(indices, area);
///     }
///
/// Where neighbourhoods overlap the surface counts once: one with area A of whose n
/// points m were not covered before adds A m / n. What was visited when the area is
/// spent depends on the order alone, what was visited when the time is over on the
/// computer too.
class SamplingBudget {
public:
  /// The time runs from here on. \param points in the cloud.
  SamplingBudget(const SamplerOptions& options, std::size_t points);

  /// Counts a neighbourhood. \param indices of its points, without repetition.
  /// \param area_m2 of its surface: that of the fitted patch, or without a fit the
  /// pi r^2 of a whole disc.
  void cover(const std::vector<int>& indices, double area_m2);

  bool isSpent() const;

  double coveredArea() const ///< m^2
  {
    return area_m2_;
  }

private:
  double max_area_m2_;
  double max_time_s_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  std::vector<bool> covered_;
  double area_m2_ = 0.0;
};

} // namespace holdfast
