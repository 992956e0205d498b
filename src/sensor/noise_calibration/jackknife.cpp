#include "jackknife.h"

#include <boost/math/distributions/students_t.hpp>

#include <algorithm>

namespace holdfast {

Estimate
jackknife(const std::vector<CellSums>& all,
          const std::function<double(const Eigen::ArrayXd&)>& statistic)
{
  std::vector<const CellSums*> cells;
  double weight = 0.0, squares = 0.0;
  Eigen::ArrayXd total;
  for (const CellSums& cell : all) {
    if (!(cell.weight > 0.0))
      continue;
    total = cells.empty() ? cell.sums : Eigen::ArrayXd(total + cell.sums);
    cells.push_back(&cell);
    weight += cell.weight;
    squares += cell.weight * cell.weight;
  }
  Estimate estimate;
  if (cells.empty())
    return estimate;
  estimate.value = statistic(total);
  if (cells.size() < 2)
    return estimate;

  const auto n = static_cast<double>(cells.size());
  double mean = n * estimate.value; // the jackknife's own estimate
  std::vector<double> without;
  for (const CellSums* cell : cells) {
    without.push_back(statistic(total - cell->sums));
    mean -= (1.0 - cell->weight / weight) * without.back();
  }
  double variance = 0.0;
  for (std::size_t j = 0; j < cells.size(); ++j) {
    const double h = weight / cells[j]->weight;
    const double pseudo = h * estimate.value - (h - 1.0) * without[j];
    variance += (pseudo - mean) * (pseudo - mean) / (h - 1.0) / n;
  }
  const double dof = std::max(1.0, weight * weight / squares - 1.0);
  const double t = quantile(boost::math::students_t(dof), 0.975);
  estimate.low = estimate.value - t * std::sqrt(variance);
  estimate.high = estimate.value + t * std::sqrt(variance);
  return estimate;
}

Estimate
rootOf(const Estimate& variance)
{
  // std::max(0, NaN) would be 0.
  const auto root = [](double x) { return x < 0.0 ? 0.0 : std::sqrt(x); };
  return {root(variance.value), root(variance.low), root(variance.high)};
}

} // namespace holdfast
