/// \file When sampling has gone on for long enough.
#pragma once

#include <holdfast/pcl/neighborhood_sampler.h>

#include <chrono>
#include <vector>

namespace holdfast {

/// True when the options limit the number of patches, the area or the time.
bool isLimited(const SamplerOptions& options);

/// Watches the limits of number, area and time while the neighbourhoods of a cloud are
/// visited:
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
/// points m were not covered before adds A m / n. When the budget is full depends on
/// the order of the visits alone, when the time is over on the computer too.
class SamplingBudget {
public:
  using Clock = std::chrono::steady_clock;

  /// \param points in the cloud. \param start from when on the time runs.
  SamplingBudget(const SamplerOptions& options,
                 std::size_t points,
                 Clock::time_point start = Clock::now());

  /// Counts a patch and its neighbourhood. \param indices of its points, without
  /// repetition; they do not matter unless limitsArea(). \param area_m2 of its surface:
  /// that of the fitted patch, or without a fit the pi r^2 of a whole disc.
  void cover(const std::vector<int>& indices, double area_m2);

  /// Enough patches or area.
  bool isFull() const;

  bool isOutOfTime() const;

  bool isSpent() const
  {
    return isFull() || isOutOfTime();
  }

  bool limitsArea() const
  {
    return max_area_m2_ > 0.0;
  }

  double coveredArea() const ///< m^2
  {
    return area_m2_;
  }

private:
  int max_patches_;
  double max_area_m2_;
  double max_time_s_;
  Clock::time_point start_;
  std::vector<bool> covered_;
  int patches_ = 0;
  double area_m2_ = 0.0;
};

} // namespace holdfast
