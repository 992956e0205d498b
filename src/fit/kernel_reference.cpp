#include "kernel.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#define HOLDFAST_INLINE inline
#define HOLDFAST_UNROLLED_FOR(...) for (__VA_ARGS__)

namespace holdfast { namespace kernel {
namespace {

using Number = double;
constexpr int kLanes = 1;

double
load(const double* p)
{
  return *p;
}

void
store(double x, double* p)
{
  *p = x;
}

double
sumOfLanes(double x)
{
  return x;
}

double
squareRoot(double x)
{
  return std::sqrt(x);
}

double
selectLess(double a, double b, double x, double y)
{
  return a < b ? x : y;
}

bool
allLess(double a, double b)
{
  return a < b;
}

#include "kernel_point.inl"
#include "kernel_valid.inl"

struct CrossTermAction {
  const Points& points;
  const State& state;
  std::vector<double>& X;

  template <typename Surface, typename ResidualPolicy>
  void run() const
  {
    X.resize(static_cast<std::size_t>(points.padded_size) * 3 *
             parameterCount(Surface::kModel));
    crossTermsOfPoints<Surface, ResidualPolicy>(points, state, X.data());
  }
};

} // namespace

void
crossTerms(Model model,
           Residual residual,
           const Points& points,
           const State& state,
           std::vector<double>& X)
{
  forSurfaceAndResidual(model, residual, CrossTermAction{points, state, X});
}

namespace reference {

int
countLeadingValid(const Points& points)
{
  return leadingValid(points);
}

void
accumulateScatter(const Points& points, ScatterSums& sums)
{
  scatterSums(points, sums);
}

void
accumulateQuadric(const Points& points,
                  const double R[9],
                  const double c[3],
                  QuadricSums& sums)
{
  quadricSums(points, R, c, sums);
}

void
accumulateNormal(Model model,
                 Residual residual,
                 const Points& points,
                 const State& state,
                 NormalSums& sums)
{
  normalSums(model, residual, points, state, sums);
}

void
accumulateCovariance(Model model,
                     Residual residual,
                     const Points& points,
                     const State& state,
                     CovarianceSums& sums)
{
  covarianceSums(model, residual, points, state, sums);
}

void
moveOntoQuadric(const Points& points,
                const double R[9],
                const double c[3],
                const double h[6],
                const double viewpoint[3],
                double* const out[3])
{
  moveOnto(points, R, c, h, viewpoint, out);
}

void
squaredResiduals(Model model,
                 Residual residual,
                 const Points& points,
                 const State& state,
                 double* out)
{
  residualsOfPoints(model, residual, points, state, out);
}

} // namespace reference
}} // namespace holdfast::kernel
