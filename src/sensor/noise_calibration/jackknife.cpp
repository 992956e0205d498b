#include "jackknife.h"

#include <boost/math/distributions/students_t.hpp>

#include <algorithm>

namespace holdfast {

Estimate
jackknife(const std::vector<CellSums>& cells,
          const std::function<double(const Eigen::ArrayXd&)>& statistic)
{
  const std::vector<Estimate> one = jackknifeAll(cells, [&](const Eigen::ArrayXd& s) {
    return Eigen::ArrayXd(Eigen::ArrayXd::Constant(1, statistic(s)));
  });
  return one.empty() ? Estimate{} : one.front();
}

std::vector<Estimate>
jackknifeAll(const std::vector<CellSums>& all,
             const std::function<Eigen::ArrayXd(const Eigen::ArrayXd&)>& statistics)
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
  if (cells.empty())
    return {};
  const Eigen::ArrayXd value = statistics(total);
  std::vector<Estimate> estimates(static_cast<std::size_t>(value.size()));
  for (std::size_t k = 0; k < estimates.size(); ++k)
    estimates[k].value = value[static_cast<Eigen::Index>(k)];
  if (cells.size() < 2)
    return estimates;

  const auto n = static_cast<double>(cells.size());
  Eigen::ArrayXd mean = n * value; // the jackknife's own estimate
  std::vector<Eigen::ArrayXd> without;
  for (const CellSums* cell : cells) {
    without.push_back(statistics(total - cell->sums));
    mean -= (1.0 - cell->weight / weight) * without.back();
  }
  Eigen::ArrayXd variance = Eigen::ArrayXd::Zero(value.size());
  for (std::size_t j = 0; j < cells.size(); ++j) {
    const double h = weight / cells[j]->weight;
    const Eigen::ArrayXd pseudo = h * value - (h - 1.0) * without[j];
    variance += (pseudo - mean).square() / (h - 1.0) / n;
  }
  const double dof = std::max(1.0, weight * weight / squares - 1.0);
  const double t = quantile(boost::math::students_t(dof), 0.975);
  for (std::size_t k = 0; k < estimates.size(); ++k) {
    const double half = t * std::sqrt(variance[static_cast<Eigen::Index>(k)]);
    estimates[k].low = estimates[k].value - half;
    estimates[k].high = estimates[k].value + half;
  }
  return estimates;
}

Estimate
rootOf(const Estimate& variance)
{
  // std::max(0, NaN) would be 0.
  const auto root = [](double x) { return x < 0.0 ? 0.0 : std::sqrt(x); };
  return {root(variance.value), root(variance.low), root(variance.high)};
}

} // namespace holdfast
