/// \file Whether estimates of one figure are right on the average and in their
/// intervals.
#pragma once

#include <holdfast/sensor/noise_calibration.h>

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <utility>
#include <vector>

namespace holdfast::test {

/// Estimates of one figure with different seeds.
class Tally {
public:
  Tally(std::string name, double truth) : name_(std::move(name)), truth_(truth) {}

  void add(const Estimate& estimate)
  {
    values_.push_back(estimate.value);
    hits_ += estimate.contains(truth_);
  }

  /// With 95 % intervals, fewer than 16 of 20 have probability 0.003, fewer than 8 of
  /// 10 have 0.012.
  void expectCovered() const
  {
    EXPECT_GE(hits_, 0.8 * static_cast<double>(values_.size())) << name_;
  }

  /// Of the mean of twenty, four standard errors are exceeded with probability 0.0008.
  /// \param bias allowed for what is known to be neglected.
  void expectUnbiased(double bias = 0.0) const
  {
    const auto n = static_cast<double>(values_.size());
    double mean = 0.0, squares = 0.0;
    for (const double value : values_)
      mean += value / n;
    for (const double value : values_)
      squares += std::pow(value - mean, 2);
    const double error = std::sqrt(squares / (n - 1.0) / n);
    // 1e-6: the step is found exactly, but for the single precision of the points.
    EXPECT_NEAR(mean, truth_, 4.0 * error + bias + 1e-6) << name_;
  }

  void expectRight(double bias = 0.0) const
  {
    expectCovered();
    expectUnbiased(bias);
  }

private:
  std::string name_;
  double truth_;
  std::vector<double> values_;
  int hits_ = 0;
};

} // namespace holdfast::test
