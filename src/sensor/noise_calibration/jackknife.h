/// \file Confidence intervals of functions of sums.
#pragma once

#include <holdfast/sensor/noise_calibration.h>

#include <Eigen/Core>

#include <functional>
#include <vector>

namespace holdfast {

/// Sums over the pixels of one cell of the image, from which an estimate follows.
struct CellSums {
  double weight = 0.0; ///< what the cell contributes, e.g. degrees of freedom
  Eigen::ArrayXd sums;
};

/// statistic(sum of all cells) with the interval of the weighted delete-one jackknife
/// (Busing, Meijer and van der Leeden, "Delete-m jackknife for unequal m", Statistics
/// and Computing 9, 1999) and Student's t with the effective number of cells. Cells
/// without weight do not count; with less than two there is no interval.
Estimate jackknife(const std::vector<CellSums>& cells,
                   const std::function<double(const Eigen::ArrayXd&)>& statistic);

/// The same for several numbers at once.
std::vector<Estimate> jackknifeAll(
    const std::vector<CellSums>& cells,
    const std::function<Eigen::ArrayXd(const Eigen::ArrayXd&)>& statistics);

/// From a variance to a standard deviation; below zero is zero.
Estimate rootOf(const Estimate& variance);

} // namespace holdfast
