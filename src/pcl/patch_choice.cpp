#include "patch_choice.h"

#include <algorithm>
#include <numeric>

namespace holdfast {
namespace {

// Of the accepted ones, best first; equals in the order of the seeds.
std::vector<std::size_t>
bestFirst(const std::vector<ExtractedPatch>& attempts)
{
  std::vector<std::size_t> order;
  std::vector<double> qualities(attempts.size());
  for (std::size_t i = 0; i < attempts.size(); ++i)
    if (isAccepted(attempts[i])) {
      order.push_back(i);
      qualities[i] = quality(attempts[i]);
    }
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return qualities[a] > qualities[b];
  });
  return order;
}

int
erase(const std::vector<bool>& is_left_out, std::vector<ExtractedPatch>& attempts)
{
  std::size_t kept = 0;
  for (std::size_t i = 0; i < attempts.size(); ++i)
    if (!is_left_out[i]) {
      if (kept != i)
        attempts[kept] = std::move(attempts[i]);
      ++kept;
    }
  const auto left_out = attempts.size() - kept;
  attempts.resize(kept);
  return static_cast<int>(left_out);
}

} // namespace

double
quality(const ExtractedPatch& patch)
{
  constexpr double kHalfAsGood = 0.1; // rad
  const double coverage = patch.validation ? patch.validation->coverage.share : 1.0;
  return coverage / (std::max(1.0, chi2PerDof(patch.fit)) *
                     (1.0 + normalSigma(patch.fit) / kHalfAsGood));
}

int
keepBest(std::size_t count, double spacing_m, std::vector<ExtractedPatch>& attempts)
{
  const std::vector<std::size_t> order = bestFirst(attempts);
  if (order.size() <= count)
    return 0;
  std::vector<std::size_t> chosen, others;
  const auto isApart = [&](std::size_t i) {
    return std::all_of(chosen.begin(), chosen.end(), [&](std::size_t better) {
      return (attempts[i].fit.patch.c - attempts[better].fit.patch.c).norm() >=
             spacing_m;
    });
  };
  for (const std::size_t i : order) {
    if (chosen.size() == count)
      break;
    (isApart(i) ? chosen : others).push_back(i);
  }
  for (std::size_t i = 0; chosen.size() < count; ++i)
    chosen.push_back(others[i]);
  std::vector<bool> is_left_out(attempts.size(), false);
  for (const std::size_t i : order)
    is_left_out[i] = true;
  for (const std::size_t i : chosen)
    is_left_out[i] = false;
  return erase(is_left_out, attempts);
}

int
thinOut(double max_overlap,
        const std::vector<std::vector<int>>& supports,
        std::size_t points,
        std::vector<ExtractedPatch>& attempts)
{
  std::vector<bool> is_taken(points, false), is_left_out(attempts.size(), false);
  for (const std::size_t i : bestFirst(attempts)) {
    const std::vector<int>& support = supports[i];
    const auto taken = std::count_if(support.begin(), support.end(), [&](int point) {
      return is_taken[static_cast<std::size_t>(point)];
    });
    is_left_out[i] =
        static_cast<double>(taken) > max_overlap * static_cast<double>(support.size());
    if (!is_left_out[i])
      for (const int point : support)
        is_taken[static_cast<std::size_t>(point)] = true;
  }
  return erase(is_left_out, attempts);
}

} // namespace holdfast
