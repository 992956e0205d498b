#include "sampling_budget.h"

namespace holdfast {

bool
isLimited(const SamplerOptions& options)
{
  return options.max_patches > 0 || options.max_area_m2 > 0.0 ||
         options.max_time_s > 0.0;
}

SamplingBudget::SamplingBudget(const SamplerOptions& options,
                               std::size_t points,
                               Clock::time_point start)
: max_patches_(options.max_patches)
, max_area_m2_(options.max_area_m2)
, max_time_s_(options.max_time_s)
, start_(start)
, covered_(points, false)
{}

void
SamplingBudget::cover(const std::vector<int>& indices, double area_m2)
{
  ++patches_;
  std::size_t fresh = 0;
  for (const int index : indices) {
    auto covered = covered_.at(static_cast<std::size_t>(index));
    fresh += covered ? 0 : 1;
    covered = true;
  }
  if (fresh > 0)
    area_m2_ +=
        area_m2 * static_cast<double>(fresh) / static_cast<double>(indices.size());
}

bool
SamplingBudget::isFull() const
{
  return (max_patches_ > 0 && patches_ >= max_patches_) ||
         (max_area_m2_ > 0.0 && area_m2_ >= max_area_m2_);
}

bool
SamplingBudget::isOutOfTime() const
{
  const std::chrono::duration<double> elapsed = Clock::now() - start_;
  return max_time_s_ > 0.0 && elapsed.count() >= max_time_s_;
}

} // namespace holdfast
