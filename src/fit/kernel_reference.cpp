#include "kernel.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#define HOLDFAST_INLINE inline
#define HOLDFAST_NOINLINE
#define HOLDFAST_UNROLLED_FOR(...) for (__VA_ARGS__)
#define HOLDFAST_ROLLED_FOR(...) for (__VA_ARGS__)

namespace holdfast { namespace kernel {
namespace {

using Number = double;
using Scalar = double;
constexpr int kLanes = 1;

double
load(const double* p)
{
  return *p;
}

double
loadAnywhere(const double* p)
{
  return *p;
}

void
store(double x, double* p)
{
  *p = x;
}

void
storeByLane(const double x[4], double* p)
{
  std::copy_n(x, 4, p);
}

void
addRow(const double* y, int, double* sum)
{
  for (int k = 0; k < kCellRow; ++k)
    sum[k] += y[k];
}

double
roundedDown(double x)
{
  return std::floor(x);
}

double
sumOfLanes(double x)
{
  return x;
}

void
sumsOfLanes(const double* v, double* out)
{
  *out = *v;
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

// There is but one precision.
void
accumulateNormalIn(Precision,
                   Model model,
                   Residual residual,
                   const Points& points,
                   const State& state,
                   NormalSums& sums)
{
  accumulateNormal(model, residual, points, state, sums);
}

void
accumulateCovarianceIn(Precision,
                       Model model,
                       Residual residual,
                       const Points& points,
                       const State& state,
                       CovarianceSums& sums)
{
  accumulateCovariance(model, residual, points, state, sums);
}

void
sumOverCellsIn(Precision, const CellSums& cells, double* out)
{
  sumOverCells(cells, out);
}

#include "kernel_table.inl"

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

const Kernel&
referenceKernel()
{
  static constexpr Kernel reference = makeKernel("scalar");
  return reference;
}

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

} // namespace reference
}} // namespace holdfast::kernel
