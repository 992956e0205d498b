/// \file Random inputs of a test, reproducible and independent of other tests.
#pragma once

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <cmath>
#include <cstdint>
#include <random>
#include <string>
#include <string_view>

namespace holdfast::test {

/// A generator seeded from the running test's suite and name and a case number. While
/// it lives, every failure message carries the case and the seed.
class Random {
public:
  explicit Random(std::uint64_t case_number = 0)
  : seed_(seedOf(case_number))
  , engine_(seed_)
  , trace_(__FILE__,
           __LINE__,
           "random case " + std::to_string(case_number) + ", seed " +
               std::to_string(seed_))
  {}

  std::uint64_t seed() const
  {
    return seed_;
  }

  std::mt19937_64& engine()
  {
    return engine_;
  }

  double uniform(double low, double high)
  {
    return std::uniform_real_distribution<double>(low, high)(engine_);
  }

  /// Both ends included.
  int integer(int low, int high)
  {
    return std::uniform_int_distribution<int>(low, high)(engine_);
  }

  double normal()
  {
    return std::normal_distribution<double>()(engine_);
  }

  /// +1 or -1.
  double sign()
  {
    return integer(0, 1) == 0 ? -1.0 : 1.0;
  }

  Eigen::Vector3d normalVector()
  {
    const double x = normal();
    const double y = normal();
    return {x, y, normal()};
  }

  Eigen::Vector3d uniformVector(double low, double high)
  {
    const double x = uniform(low, high);
    const double y = uniform(low, high);
    return {x, y, uniform(low, high)};
  }

  /// Uniform on the sphere.
  Eigen::Vector3d unitVector()
  {
    return normalVector().normalized();
  }

  /// Uniform over all rotations.
  Eigen::Matrix3d rotation()
  {
    const double w = normal();
    const Eigen::Vector3d v = normalVector();
    return Eigen::Quaterniond(w, v.x(), v.y(), v.z()).normalized().toRotationMatrix();
  }

private:
  // FNV-1a rather than std::hash: the same seed on every platform.
  static std::uint64_t hash(std::string_view text, std::uint64_t start)
  {
    std::uint64_t value = start;
    for (const char ch : text)
      value = (value ^ static_cast<unsigned char>(ch)) * 1099511628211ull;
    return value;
  }

  static std::uint64_t seedOf(std::uint64_t case_number)
  {
    std::string text = "/" + std::to_string(case_number);
    if (const auto* info = testing::UnitTest::GetInstance()->current_test_info())
      text = std::string(info->test_suite_name()) + "." + info->name() + text;
    return hash(text, 14695981039346656037ull);
  }

  std::uint64_t seed_;
  std::mt19937_64 engine_;
  testing::ScopedTrace trace_;
};

} // namespace holdfast::test
