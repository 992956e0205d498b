#include <holdfast/evaluation/metrics.h>

#include "geometry/symmetric_eigen.h"
#include <holdfast/geometry/gaussian.h>
#include <holdfast/geometry/rotation.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>

namespace holdfast {
namespace {

// Share of an eigenvector's squared length that its named components make up.
constexpr double kNamedShare = 0.9;

// Mean and variance in one pass (Welford), without the cancellation of sums of squares.
class RunningMoments {
public:
  void add(double x)
  {
    ++n_;
    const double before = x - mean_;
    mean_ += before / n_;
    squares_ += before * (x - mean_);
  }

  MeanAndVariance result() const
  {
    return {mean_, squares_ / (n_ - 1)};
  }

private:
  int n_ = 0;
  double mean_ = 0.0;
  double squares_ = 0.0;
};

class MetricsAccumulator {
public:
  explicit MetricsAccumulator(const Patch& patch) : patch_(patch) {}

  void add(const ParameterVector& sample)
  {
    const PatchDistances distance = patchDistances(patch_, unpack(patch_.type, sample));
    phi_5_.add(distance.phi_5);
    phi_6_.add(distance.phi_6);
    phi_t_.add(distance.phi_t);
    phi_k_.add(distance.phi_k);
    phi_d_.add(distance.phi_d);
  }

  PatchMetrics result() const
  {
    return {phi_5_.result(),
            phi_6_.result(),
            phi_t_.result(),
            phi_k_.result(),
            phi_d_.result()};
  }

private:
  const Patch& patch_;
  RunningMoments phi_5_, phi_6_, phi_t_, phi_k_, phi_d_;
};

void
requireTwo(std::size_t samples)
{
  if (samples < 2)
    throw std::invalid_argument("a variance needs two samples or more");
}

void
requireSize(PatchType type, const ParameterMatrix& covariance)
{
  const int n = degreesOfFreedom(type);
  if (covariance.rows() != n || covariance.cols() != n)
    throw std::invalid_argument("the covariance must be " + std::to_string(n) + " x " +
                                std::to_string(n));
}

// The angle between two unit vectors, exact for small ones.
double
angleBetween(const Eigen::Vector3d& a, const Eigen::Vector3d& b)
{
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

double
rotationAngle(const Patch& p, const Patch& s)
{
  if (isRevolute(p.type))
    return angleBetween(p.normal(), s.normal());
  return logMap(expMap(p.r) * expMap(s.r).transpose()).norm();
}

PrincipalDeviation
principalDeviation(double variance,
                   const ParameterVector& axis,
                   const std::vector<std::string>& names)
{
  std::vector<int> order(names.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&axis](int i, int j) {
    return std::abs(axis[i]) > std::abs(axis[j]);
  });
  const double sign = axis[order.front()] < 0.0 ? -1.0 : 1.0;
  PrincipalDeviation deviation;
  deviation.sigma = std::sqrt(std::max(0.0, variance));
  double share = 0.0;
  for (std::size_t i = 0; i < order.size() && share < kNamedShare; ++i) {
    const double weight = sign * axis[order[i]];
    deviation.components.push_back({names[static_cast<std::size_t>(order[i])], weight});
    share += weight * weight;
  }
  return deviation;
}

} // namespace

PatchDistances
patchDistances(const Patch& p, const Patch& s)
{
  if (p.type != s.type)
    throw std::invalid_argument("patches of different types have no distance");
  PatchDistances distance;
  distance.phi_6 = rotationAngle(p, s);
  distance.phi_5 = 2.0 * std::sin(0.5 * distance.phi_6);
  distance.phi_t = (p.c - s.c).norm();
  distance.phi_k = (p.kappa - s.kappa).norm();
  distance.phi_d = (p.d - s.d).norm();
  return distance;
}

PatchMetrics
metricsOf(const Patch& patch, const std::vector<ParameterVector>& samples)
{
  requireTwo(samples.size());
  MetricsAccumulator accumulator(patch);
  for (const ParameterVector& sample : samples)
    accumulator.add(sample);
  return accumulator.result();
}

PatchMetrics
sampleMetrics(const Patch& patch,
              const ParameterMatrix& covariance,
              std::mt19937_64& generator,
              int n_v)
{
  requireTwo(static_cast<std::size_t>(std::max(n_v, 0)));
  requireSize(patch.type, covariance);
  const ParameterVector mean = pack(patch);
  const ParameterMatrix root = squareRoot(covariance);
  MetricsAccumulator accumulator(patch);
  for (int i = 0; i < n_v; ++i)
    accumulator.add(sampleGaussian(mean, root, generator));
  return accumulator.result();
}

std::vector<PrincipalDeviation>
principalDeviations(PatchType type, const ParameterMatrix& covariance)
{
  requireSize(type, covariance);
  const SymmetricEigen eigen = symmetricEigen(symmetrized(covariance));
  const std::vector<std::string> names = parameterNames(type);
  std::vector<PrincipalDeviation> deviations;
  for (Eigen::Index i = covariance.rows() - 1; i >= 0; --i) // eigenvalues ascend
    deviations.push_back(
        principalDeviation(eigen.values[i], eigen.vectors.col(i), names));
  return deviations;
}

} // namespace holdfast
