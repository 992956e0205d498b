// The sums over the points: SIMD against reference, and every derivative against finite
// differences of the cost, written down here again for any quadric.
#include "support/random.h"

#include "fit/kernel.h"
#include "fit/surface_fit.h"
#include "geometry/symmetric.h"
#include <holdfast/fit/point_batch.h>

#include <functional>
#include <limits>
#include <tuple>

namespace holdfast { namespace kernel { namespace {

using test::Random;

// In long double, differences of order 1e-4 leave ten digits of a second derivative.
using Real = long double;
using Vector3 = Eigen::Matrix<Real, 3, 1>;
using Matrix3 = Eigen::Matrix<Real, 3, 3>;
using Vector = Eigen::Matrix<Real, Eigen::Dynamic, 1>;
using Matrix = Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic>;

// f(q) = q^T A q + b^T q + e.
struct Quadric {
  Matrix3 A = Matrix3::Zero();
  Vector3 b = Vector3::Zero();
  Real e = 0;

  Quadric operator+(const Quadric& o) const
  {
    return {A + o.A, b + o.b, e + o.e};
  }
  Quadric operator*(Real s) const
  {
    return {A * s, b * s, e * s};
  }
};

struct Point {
  Vector3 q;
  Matrix3 S;
};

// The residual e, E = e^2 / 2: first order, or along the ray with its continuation
// where the ray all but misses.
Real
residualAt(const Quadric& quadric, const Point& point, Residual residual)
{
  const Vector3 g = 2 * quadric.A * point.q + quadric.b;
  const Vector3 v = point.S * g;
  const Real f = point.q.dot(quadric.A * point.q) + quadric.b.dot(point.q) + quadric.e;
  const Real V = g.dot(v), w = v.dot(quadric.A * v);
  const Real first_order = f / std::sqrt(V);
  if (residual == Residual::Sampson)
    return first_order;
  const Real x = 1 - 4 * f * w / (V * V);
  const Real s = x < Real(0.25) ? Real(0.25) / (Real(0.75) - x) : std::sqrt(x);
  return 2 / (1 + s) * first_order;
}

// First and second derivatives by four-point differences.
constexpr Real kStep = 1e-4L, kSmallStep = 1e-5L;

Real
derivative(const std::function<Real(Real)>& f, Real h = kStep)
{
  return (8 * (f(h) - f(-h)) - (f(2 * h) - f(-2 * h))) / (12 * h);
}

Real
mixedDerivative(const std::function<Real(Real, Real)>& f)
{
  constexpr Real h = 3e-5L;
  return derivative(
      [&](Real x) { return derivative([&](Real y) { return f(x, y); }, h); },
      h);
}

// exp([delta]x) by its series, for small delta.
Matrix3
smallRotation(const Vector3& delta)
{
  Matrix3 X;
  X << 0, -delta.z(), delta.y(), delta.z(), 0, -delta.x(), -delta.y(), delta.x(), 0;
  Matrix3 sum = Matrix3::Identity(), term = sum;
  for (int i = 1; i < 12; ++i) {
    term = (term * X / Real(i)).eval();
    sum += term;
  }
  return sum;
}

// A surface and noisy points about it, in the surface's own frame and in a batch.
struct Problem {
  Model model = Model::Plane;
  Residual residual = Residual::Sampson;
  UnboundedSurface surface;
  Scatter scatter;
  PointBatch batch;
  std::vector<Point> points; // local frame

  // Brings the batch's points into the frame of the surface.
  void enterFrame()
  {
    const Points view = kernelView();
    const Matrix3 R = surface.R.cast<Real>();
    points.clear();
    for (int i = 0; i < batch.size(); ++i) {
      const Vector3 offset(view.channel[0][i], view.channel[1][i], view.channel[2][i]);
      points.push_back({R.transpose() * (offset - surface.c.cast<Real>()),
                        R.transpose() * batch.covariance(i).cast<Real>() * R});
    }
  }

  // The surface moved by theta as the header says, as a quadric in the frame of the
  // unmoved one.
  Quadric moved(const Vector& theta) const
  {
    const Matrix3 R0 = surface.R.cast<Real>();
    Matrix3 K = Matrix3::Zero();
    Vector3 delta = Vector3::Zero(), shift = Vector3::Zero();
    Vector3 k = surface.k.cast<Real>();
    switch (model) {
    case Model::Paraboloid:
      k += theta.head<3>();
      K << k[0], k[1], 0, k[1], k[2], 0, 0, 0, 0;
      delta.head<2>() = theta.segment<2>(3);
      shift = R0.transpose() * scatter.normal().cast<Real>() * theta[5];
      break;
    case Model::Sphere:
      K = (k[0] + theta[0]) * Matrix3::Identity();
      shift = theta.segment<3>(1);
      break;
    case Model::Cylinder:
      K(1, 1) = K(2, 2) = k[0] + theta[0];
      delta.tail<2>() = theta.segment<2>(1);
      shift.tail<2>() = theta.segment<2>(3);
      break;
    case Model::Plane:
      delta.head<2>() = theta.head<2>();
      shift.z() = theta[2];
      break;
    }
    const Matrix3 R = smallRotation(delta);
    // f = p^T K p - 2 z^T p, p = R^T (q - shift).
    Quadric quadric;
    quadric.A = R * K * R.transpose();
    quadric.b = -2 * quadric.A * shift - 2 * R.col(2);
    quadric.e = shift.dot(quadric.A * shift) + 2 * R.col(2).dot(shift);
    return quadric;
  }

  Quadric quadric() const
  {
    return moved(Vector::Zero(kMaxTheta));
  }

  // f_a as a quadric.
  Quadric slope(int a) const
  {
    const auto at = [&](Real x) {
      Vector theta = Vector::Zero(kMaxTheta);
      theta[a] = x;
      return moved(theta);
    };
    const Quadric near = at(kStep) + at(-kStep) * -1;
    const Quadric far = at(2 * kStep) + at(-2 * kStep) * -1;
    return (near * 8 + far * -1) * (1 / (12 * kStep));
  }

  Real cost(const Quadric& q) const
  {
    Real sum = 0;
    for (const Point& point : points) {
      const Real e = residualAt(q, point, residual);
      sum += e * e / 2;
    }
    return sum;
  }

  Points kernelView() const
  {
    return kernelPoints(batch);
  }
  State state() const
  {
    return kernelState(surface, scatter);
  }

  NormalSums normalSums() const
  {
    NormalSums sums;
    kernel().accumulateNormal(Precision::Double,
                              model,
                              residual,
                              kernelView(),
                              state(),
                              sums);
    return sums;
  }
  CovarianceSums covarianceSums() const
  {
    CovarianceSums sums;
    kernel().accumulateCovariance(Precision::Double,
                                  model,
                                  residual,
                                  kernelView(),
                                  state(),
                                  sums);
    return sums;
  }
};

// A positive definite covariance, sigmas of 1-4 mm.
Eigen::Matrix3d
randomCovariance(Random& random)
{
  const Eigen::Matrix3d R = random.rotation();
  const Eigen::Vector3d sigma = random.uniformVector(1e-3, 4e-3);
  return R * sigma.cwiseAbs2().asDiagonal() * R.transpose();
}

UnboundedSurface
randomSurface(Model model, Random& random)
{
  UnboundedSurface surface;
  surface.model = model;
  surface.R = random.rotation();
  surface.c = random.uniformVector(-0.3, 0.3);
  surface.k = random.uniformVector(-6.0, 6.0);
  if (model != Model::Paraboloid)
    surface.k.tail<2>().setZero();
  return surface;
}

// Points about the surface's tangent plane at its origin, `spread_m` off it: 4 mm is
// noise, 0.3 m sends rays past the surface.
Problem
randomProblem(Model model,
              Residual residual,
              int count,
              double spread_m,
              Random& random)
{
  Problem p;
  p.model = model;
  p.residual = residual;
  p.surface = randomSurface(model, random);
  const Eigen::Vector3d origin = random.uniformVector(-5.0, 5.0);
  p.batch.clear(origin);
  for (int i = 0; i < count; ++i) {
    const double x = random.uniform(-0.1, 0.1), y = random.uniform(-0.1, 0.1);
    const double k = p.surface.k[0], z = 0.5 * k * (x * x + y * y);
    const Eigen::Vector3d q(x, y, z + spread_m * random.normal());
    const Eigen::Matrix3d S = randomCovariance(random);
    p.batch.add(origin + p.surface.c + p.surface.R * q, S);
  }
  p.batch.pad();
  p.scatter = measureScatter(p.batch, false, p.surface.R.col(2));
  p.enterFrame();
  return p;
}

constexpr double kNoiseSpread = 4e-3, kFarSpread = 0.3;

class KernelSums : public testing::TestWithParam<std::tuple<Model, Residual, double>> {
protected:
  Problem problem(Random& random, int count = 21) const
  {
    const auto [model, residual, spread] = GetParam();
    return randomProblem(model, residual, count, spread, random);
  }
};

// The differences leave nine digits at best, rounding in double (f is a difference of
// terms a hundred times larger) some more.
constexpr double kRelative = 1e-8;

void
expectClose(double actual, Real expected, Real magnitude, const std::string& what)
{
  EXPECT_LE(std::abs(actual - static_cast<double>(expected)),
            kRelative * static_cast<double>(magnitude))
      << what << ": " << actual << " for " << static_cast<double>(expected);
}

constexpr std::uint64_t kCases = 5;

TEST_P(KernelSums, CostIsHalfTheSquaredResiduals)
{
  for (std::uint64_t i = 0; i < kCases; ++i) {
    Random random(i);
    const Problem p = problem(random);
    const NormalSums normal = p.normalSums();
    const CovarianceSums covariance = p.covarianceSums();
    const Real cost = p.cost(p.quadric());
    expectClose(normal.cost, cost, cost, "normal");
    expectClose(covariance.cost, cost, cost, "covariance");
  }
}

TEST_P(KernelSums, SquaredResidualsAreTwiceTheCostOfEveryPoint)
{
  for (std::uint64_t i = 0; i < kCases; ++i) {
    Random random(i);
    const Problem p = problem(random);
    const Points all = p.kernelView();
    std::vector<double> fast(static_cast<std::size_t>(all.padded_size));
    std::vector<double> plain(fast.size());
    kernel().squaredResiduals(p.model, p.residual, all, p.state(), fast.data());
    referenceKernel().squaredResiduals(p.model,
                                       p.residual,
                                       all,
                                       p.state(),
                                       plain.data());
    double sum = 0.0;
    for (std::size_t k = 0; k < fast.size(); ++k) {
      expectClose(fast[k], plain[k], 1.0 + plain[k], "fast");
      EXPECT_TRUE(k < p.points.size() || fast[k] == 0.0);
      sum += plain[k];
    }
    const Real cost = p.cost(p.quadric());
    expectClose(0.5 * sum, cost, cost, "sum");
  }
}

// L[p] is the derivative of the cost as f grows by epsilon p.
TEST_P(KernelSums, LIsTheDerivativeOfTheCostAlongAPolynomial)
{
  for (std::uint64_t i = 0; i < kCases; ++i) {
    Random random(i);
    const Problem p = problem(random);
    const CovarianceSums covariance = p.covarianceSums();
    constexpr int kRow[] = {0, 1, 2, 0, 0, 1}, kColumn[] = {0, 1, 2, 1, 2, 2};
    // L[z] of a plane is zero; its terms of 0.01 m or more cancel.
    Real magnitude_of_one = 0;
    // Derivatives of a plane are linear: no more of L is used.
    const int count = p.model == Model::Plane ? PXX : kPolynomials;
    for (int m = 0; m < count; ++m) {
      Quadric polynomial;
      if (m == P1)
        polynomial.e = 1;
      else if (m <= PZ)
        polynomial.b[m - PX] = 1;
      else {
        polynomial.A(kRow[m - PXX], kColumn[m - PXX]) += Real(0.5);
        polynomial.A(kColumn[m - PXX], kRow[m - PXX]) += Real(0.5);
      }
      Real magnitude = 0.01L * magnitude_of_one, sum = 0;
      for (const Point& point : p.points) {
        const Real term = derivative(
            [&](Real x) {
              const Real e =
                  residualAt(p.quadric() + polynomial * x, point, p.residual);
              return e * e / 2;
            },
            kSmallStep);
        sum += term;
        magnitude += std::abs(term);
      }
      if (m == P1)
        magnitude_of_one = magnitude;
      expectClose(covariance.L[m], sum, magnitude, "L " + std::to_string(m));
    }
  }
}

TEST_P(KernelSums, GradientIsTheDerivativeOfTheCost)
{
  for (std::uint64_t i = 0; i < kCases; ++i) {
    Random random(i);
    const Problem p = problem(random);
    const NormalSums normal = p.normalSums();
    const CovarianceSums covariance = p.covarianceSums();
    for (int a = 0; a < parameterCount(p.model); ++a) {
      Real sum = 0, magnitude = 0;
      for (const Point& point : p.points) {
        const Real term = derivative(
            [&](Real x) {
              const Real e =
                  residualAt(p.quadric() + p.slope(a) * x, point, p.residual);
              return e * e / 2;
            },
            kSmallStep);
        sum += term;
        magnitude += std::abs(term);
      }
      expectClose(normal.gradient[a], sum, magnitude, "normal");
      expectClose(covariance.gradient[a], sum, magnitude, "covariance");
    }
  }
}

TEST_P(KernelSums, JIsTheDerivativeOfTheResiduals)
{
  for (std::uint64_t i = 0; i < kCases; ++i) {
    Random random(i);
    const Problem p = problem(random);
    const int n = parameterCount(p.model);
    const NormalSums sums = p.normalSums();
    Matrix JtJ = Matrix::Zero(n, n);
    for (const Point& point : p.points) {
      Vector J(n);
      for (int a = 0; a < n; ++a)
        J[a] = derivative(
            [&](Real x) {
              return residualAt(p.quadric() + p.slope(a) * x, point, p.residual);
            },
            kSmallStep);
      JtJ += J * J.transpose();
    }
    for (int a = 0, entry = 0; a < n; ++a)
      for (int b = a; b < n; ++b, ++entry)
        expectClose(sums.JtJ[entry],
                    JtJ(a, b),
                    std::sqrt(JtJ(a, a) * JtJ(b, b)),
                    "JtJ");
  }
}

// Without the part L[f_ab] that has second derivatives of f: f linear in theta.
TEST_P(KernelSums, HIsTheHessianOfTheCostWithFLinearInTheta)
{
  Random random;
  const Problem p = problem(random);
  const CovarianceSums sums = p.covarianceSums();
  const int n = shapeParameterCount(p.model);
  Matrix H(n, n);
  for (int a = 0; a < n; ++a)
    for (int b = a; b < n; ++b)
      H(a, b) = mixedDerivative([&](Real x, Real y) {
        return p.cost(p.quadric() + p.slope(a) * x + p.slope(b) * y);
      });
  for (int a = 0, entry = 0; a < n; ++a)
    for (int b = a; b < n; ++b, ++entry) {
      // The second difference of the cost has lost half the digits of long double.
      const Real magnitude =
          std::sqrt(std::abs(H(a, a) * H(b, b))) + Real(1e2) * p.cost(p.quadric());
      expectClose(sums.H[entry], H(a, b), magnitude, "H");
    }
}

// X_i = d^2E / dtheta dq_i of every point, by moving the point.
std::vector<Matrix>
differencedCrossTerms(const Problem& p)
{
  const int n = parameterCount(p.model);
  std::vector<Matrix> X;
  for (const Point& point : p.points) {
    Matrix terms(n, 3);
    for (int a = 0; a < n; ++a)
      for (int k = 0; k < 3; ++k) {
        const Quadric slope = p.slope(a);
        terms(a, k) = derivative(
            [&](Real y) {
              Point moved = point;
              moved.q[k] += y;
              return derivative(
                  [&](Real x) {
                    const Real e =
                        residualAt(p.quadric() + slope * x, moved, p.residual);
                    return e * e / 2;
                  },
                  kSmallStep);
            },
            kSmallStep);
      }
    X.push_back(terms);
  }
  return X;
}

TEST_P(KernelSums, CrossTermsAreMixedDerivativesOfTheCost)
{
  Random random;
  const Problem p = problem(random);
  const int n = parameterCount(p.model);
  std::vector<double> X;
  crossTerms(p.model, p.residual, p.kernelView(), p.state(), X);
  const std::vector<Matrix> expected = differencedCrossTerms(p);
  for (std::size_t i = 0; i < expected.size(); ++i) {
    const Real magnitude = expected[i].cwiseAbs().maxCoeff();
    for (int a = 0; a < n; ++a)
      for (int k = 0; k < 3; ++k)
        expectClose(X[3 * (n * i + a) + k], expected[i](a, k), magnitude, "X");
  }
}

// The other sums of the covariance follow from X_i, Sigma_i and the point.
TEST_P(KernelSums, CovarianceSumsAreThoseOfTheCrossTerms)
{
  Random random;
  const Problem p = problem(random);
  const int n = parameterCount(p.model);
  const CovarianceSums sums = p.covarianceSums();
  const std::vector<Matrix> terms = differencedCrossTerms(p);
  using symmetric::kColumn, symmetric::kRow;
  Vector3 centroid;
  for (int k = 0; k < 3; ++k)
    centroid[k] = p.state().centroid[k];
  Matrix XX = Matrix::Zero(n, n), X = Matrix::Zero(n, 3), XS = X;
  Matrix XSq = Matrix::Zero(n, 6), S = Matrix::Zero(1, 6), qS = Matrix::Zero(3, 6),
         qqS = Matrix::Zero(6, 6);
  for (std::size_t i = 0; i < terms.size(); ++i) {
    const Point& point = p.points[i];
    const Vector3 qt = point.q - centroid;
    const Matrix noise = terms[i] * point.S;
    X += terms[i];
    XS += noise;
    XX += noise * terms[i].transpose();
    for (int e = 0; e < 6; ++e) {
      const Real s = point.S(kRow[e], kColumn[e]);
      XSq.col(e) +=
          noise.col(kRow[e]) * qt[kColumn[e]] + noise.col(kColumn[e]) * qt[kRow[e]];
      S(0, e) += s;
      qS.col(e) += s * qt;
      for (int o = 0; o < 6; ++o)
        qqS(o, e) += s * qt[kRow[o]] * qt[kColumn[o]];
    }
  }
  const auto expectMatrix = [](const double* actual,
                               const Matrix& expected,
                               const char* what) {
    const Real magnitude = expected.cwiseAbs().maxCoeff();
    for (int a = 0; a < expected.rows(); ++a)
      for (int b = 0; b < expected.cols(); ++b)
        expectClose(actual[a * expected.cols() + b], expected(a, b), magnitude, what);
  };
  expectMatrix(sums.X[0], X, "X");
  expectMatrix(sums.XS[0], XS, "XS");
  expectMatrix(sums.XSq[0], XSq, "XSq");
  expectMatrix(sums.S, S, "S");
  expectMatrix(sums.qS[0], qS, "qS");
  expectMatrix(sums.qqS[0], qqS, "qqS");
  for (int a = 0, entry = 0; a < n; ++a)
    for (int b = a; b < n; ++b, ++entry)
      expectClose(sums.XX[entry], XX(a, b), std::sqrt(XX(a, a) * XX(b, b)), "XX");
}

// Far points test the ray residual's continuation: some of their rays must miss.
TEST(KernelRay, FarPointsMissTheSurface)
{
  Random random;
  const Problem p =
      randomProblem(Model::Sphere, Residual::Ray, 200, kFarSpread, random);
  const Quadric q = p.quadric();
  int missing = 0;
  for (const Point& point : p.points) {
    const Vector3 g = 2 * q.A * point.q + q.b, v = point.S * g;
    const Real f = point.q.dot(q.A * point.q) + q.b.dot(point.q) + q.e;
    missing += 1 - 4 * f * v.dot(q.A * v) / (g.dot(v) * g.dot(v)) < Real(0.25);
  }
  EXPECT_GT(missing, 10);
  EXPECT_LT(missing, 190);
}

// e^2 is the squared Mahalanobis distance to where the ray meets the surface.
TEST(KernelRay, ResidualIsTheDistanceAlongTheRay)
{
  for (const Model model : {Model::Paraboloid, Model::Sphere, Model::Cylinder}) {
    Random random(static_cast<std::uint64_t>(model));
    Problem p = randomProblem(model, Residual::Ray, 1, kNoiseSpread, random);
    const Quadric quadric = p.quadric();
    const Point& point = p.points.front();
    const Vector3 v = point.S * (2 * quadric.A * point.q + quadric.b);
    const auto f = [&](Real t) {
      const Vector3 q = point.q - t * v;
      return q.dot(quadric.A * q) + quadric.b.dot(q) + quadric.e;
    };
    Real t = 0;
    for (int i = 0; i < 20; ++i)
      t -= f(t) / derivative([&](Real x) { return f(t + x); });
    const Real distance = t * t * v.dot(point.S.inverse() * v);
    EXPECT_NEAR(2.0 * p.normalSums().cost, static_cast<double>(distance), 1e-9);
  }
}

// ---- SIMD against reference --------------------------------------------------------

// A sum's arrays, each of one kind of entry.
std::vector<std::size_t>
groupSizes(const NormalSums&)
{
  return {1, kMaxTheta, 21};
}
std::vector<std::size_t>
groupSizes(const CovarianceSums&)
{
  return {1,
          kMaxTheta,
          kPolynomials,
          15,
          3 * kMaxTheta,
          21,
          3 * kMaxTheta,
          6 * kMaxTheta,
          6,
          18,
          36};
}
std::vector<std::size_t>
groupSizes(const ScatterSums&)
{
  return {3, 6, 6};
}
std::vector<std::size_t>
groupSizes(const QuadricSums&)
{
  return {15, 6};
}

template <typename Sums>
using Entries = Eigen::Array<double, sizeof(Sums) / sizeof(double), 1>;

// All sums of one kind as an array; what the model does not use stays zero.
template <typename Sums, typename Accumulate>
Entries<Sums>
entriesOf(const Accumulate& accumulate, const Kernel& code, const Points& points)
{
  Sums sums{};
  accumulate(code, points, sums);
  return Eigen::Map<const Entries<Sums>>(reinterpret_cast<const double*>(&sums));
}

// The i-th point alone; the reference code takes one at a time and needs no padding.
Points
singlePoint(const Points& points, int i)
{
  Points single = points;
  for (const double*& channel : single.channel)
    channel += i;
  single.padded_size = 1;
  return single;
}

struct Rounding {
  double of_terms = 1e-12, of_cancelled = 1e-13;
};

// The sums by `tested` against those of the reference over single points. Products
// may be fused in one and not in the other, which changes some units in the last place
// of terms of which some cancel a hundredfold; what cancels altogether is compared with
// the largest entry of its group.
template <typename Sums, typename Accumulate>
void
expectSumOfPoints(const PointBatch& batch,
                  const Accumulate& accumulate,
                  const Kernel& tested,
                  const Rounding& rounding = {})
{
  const Points points = kernelPoints(batch);
  const Entries<Sums> actual = entriesOf<Sums>(accumulate, tested, points);
  Entries<Sums> expected = Entries<Sums>::Zero(), magnitude = expected;
  for (int i = 0; i < batch.size(); ++i) {
    const Entries<Sums> term =
        entriesOf<Sums>(accumulate, referenceKernel(), singlePoint(points, i));
    expected += term;
    magnitude += term.abs();
  }
  Eigen::Index e = 0;
  for (const std::size_t size : groupSizes(Sums{})) {
    const double largest =
        magnitude.segment(e, static_cast<Eigen::Index>(size)).maxCoeff();
    for (std::size_t i = 0; i < size; ++i, ++e)
      EXPECT_NEAR(actual[e],
                  expected[e],
                  rounding.of_terms * magnitude[e] + rounding.of_cancelled * largest)
          << tested.instruction_set << ", entry " << e << " of " << batch.size()
          << " points";
  }
  EXPECT_EQ(e, actual.size());
}

// Both codes: the fast one shows that SIMD agrees, the reference that padding adds
// nothing.
template <typename Sums, typename Accumulate>
void
expectBothAgree(const PointBatch& batch, const Accumulate& accumulate)
{
  expectSumOfPoints<Sums>(batch, accumulate, kernel());
  expectSumOfPoints<Sums>(batch, accumulate, referenceKernel());
}

TEST_P(KernelSums, SimdSumsAreThoseOfThePointsWithoutPadding)
{
  for (int count = 1; count <= PointBatch::kLaneMultiple + 1; ++count) {
    Random random(static_cast<std::uint64_t>(count));
    const Problem p = problem(random, count);
    State state = p.state();
    // The centroid itself would make the moments of a single point rounding alone.
    state.centroid[0] += 0.01;
    expectBothAgree<NormalSums>(
        p.batch,
        [&](const Kernel& code, const Points& points, NormalSums& sums) {
          code.accumulateNormal(Precision::Double,
                                p.model,
                                p.residual,
                                points,
                                state,
                                sums);
        });
    expectBothAgree<CovarianceSums>(
        p.batch,
        [&](const Kernel& code, const Points& points, CovarianceSums& sums) {
          code.accumulateCovariance(Precision::Double,
                                    p.model,
                                    p.residual,
                                    points,
                                    state,
                                    sums);
        });
  }
}

// What cancels is in double, so that ten operations on floats are what is left of
// rounding; in sums of products of two of their results, twice that.
TEST_P(KernelSums, InSinglePrecisionAreRightToSevenDigits)
{
  // Where rays all but miss, s^-3 makes eight of one.
  const double rounding = std::get<2>(GetParam()) > kNoiseSpread ? 8e-6 : 1e-6;
  const Rounding single{rounding, rounding};
  for (int count = 1; count <= 2 * PointBatch::kLaneMultiple + 1; count += 3) {
    Random random(static_cast<std::uint64_t>(count));
    const Problem p = problem(random, count);
    State state = p.state();
    state.centroid[0] += 0.01; // as above
    expectSumOfPoints<NormalSums>(
        p.batch,
        [&](const Kernel& code, const Points& points, NormalSums& sums) {
          code.accumulateNormal(Precision::Single,
                                p.model,
                                p.residual,
                                points,
                                state,
                                sums);
        },
        kernel(),
        single);
    expectSumOfPoints<CovarianceSums>(
        p.batch,
        [&](const Kernel& code, const Points& points, CovarianceSums& sums) {
          code.accumulateCovariance(Precision::Single,
                                    p.model,
                                    p.residual,
                                    points,
                                    state,
                                    sums);
        },
        kernel(),
        single);
  }
}

TEST(KernelMoments, SimdSumsAreThoseOfThePointsWithoutPadding)
{
  for (int count = 1; count <= 17; ++count) {
    Random random(static_cast<std::uint64_t>(count));
    const Problem p =
        randomProblem(Model::Paraboloid, Residual::Sampson, count, kFarSpread, random);
    const State state = p.state();
    expectBothAgree<ScatterSums>(
        p.batch,
        [](const Kernel& code, const Points& points, ScatterSums& sums) {
          code.accumulateScatter(points, sums);
        });
    expectBothAgree<QuadricSums>(
        p.batch,
        [&](const Kernel& code, const Points& points, QuadricSums& sums) {
          code.accumulateQuadric(points, state.R, state.c, sums);
        });
  }
}

// Every channel of every point spoilt in turn, the padding of the last block included.
TEST(KernelValidity, CountStopsInTheLanesOfTheFirstInvalidPoint)
{
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  constexpr int kCount = 21;
  Random random;
  Problem p =
      randomProblem(Model::Paraboloid, Residual::Sampson, kCount, kNoiseSpread, random);
  const Points points = p.kernelView();
  EXPECT_EQ(countLeadingValid(points), points.padded_size);
  EXPECT_EQ(reference::countLeadingValid(points), points.padded_size);
  for (int channel = PointBatch::X; channel < PointBatch::W; ++channel)
    for (int i = 0; i < kCount; ++i) {
      double& value = p.batch.channel(static_cast<PointBatch::Channel>(channel))[i];
      const double sound = value;
      for (const double bad : {kNaN, kInfinity, -kInfinity}) {
        value = bad;
        EXPECT_EQ(reference::countLeadingValid(points), i);
        EXPECT_LE(countLeadingValid(points), i);
        EXPECT_GT(countLeadingValid(points), i - PointBatch::kLaneMultiple);
      }
      value = sound;
    }
}

TEST(KernelMoments, AreThoseOfTheDefinition)
{
  Random random;
  const Problem p =
      randomProblem(Model::Paraboloid, Residual::Sampson, 13, kFarSpread, random);
  ScatterSums scatter;
  QuadricSums quadric;
  kernel().accumulateScatter(p.kernelView(), scatter);
  kernel().accumulateQuadric(p.kernelView(), p.state().R, p.state().c, quadric);
  using symmetric::kColumn, symmetric::kRow;
  double q[3] = {}, qq[6] = {}, sigma[6] = {}, monomial[15] = {}, z[6] = {};
  for (int i = 0; i < 13; ++i) {
    const Eigen::Vector3d offset = p.batch.point(i) - p.batch.origin();
    const Eigen::Vector3d local =
        p.points[static_cast<std::size_t>(i)].q.cast<double>();
    for (int k = 0; k < 3; ++k)
      q[k] += offset[k];
    for (int e = 0; e < 6; ++e) {
      qq[e] += offset[kRow[e]] * offset[kColumn[e]];
      sigma[e] += p.batch.covariance(i)(kRow[e], kColumn[e]);
    }
    for (int degree = 0, at = 0; degree <= 4; ++degree)
      for (int y = 0; y <= degree; ++y, ++at) {
        const double term = std::pow(local.x(), degree - y) * std::pow(local.y(), y);
        monomial[at] += term;
        if (at < 6)
          z[at] += term * local.z();
      }
  }
  constexpr double kRounding = 1e-14;
  const auto expectArray = [](const double* actual, const double* expected, int n) {
    for (int e = 0; e < n; ++e)
      EXPECT_NEAR(actual[e], expected[e], kRounding) << e;
  };
  expectArray(scatter.q, q, 3);
  expectArray(scatter.qq, qq, 6);
  expectArray(scatter.sigma, sigma, 6);
  expectArray(quadric.monomial, monomial, 15);
  expectArray(quadric.z, z, 6);
}

// ---- The Hessian with the second derivatives of f, at the minimum ------------------

class FittedSurface : public testing::TestWithParam<std::tuple<Model, Residual>> {};

TEST_P(FittedSurface, HasZeroGradientAndTheHessianOfTheCost)
{
  const auto [model, residual] = GetParam();
  Random random;
  Problem p = randomProblem(model, residual, 60, kNoiseSpread, random);
  FitOptions options;
  options.residual = residual;
  options.polish_tolerance_sigma = 1e-11;
  const SurfaceFit fit = fitSurface(model, p.batch, p.scatter, {}, options);
  ASSERT_EQ(fit.status, FitStatus::Converged);
  p.surface = fit.surface;
  p.enterFrame();
  const int n = parameterCount(model);
  const auto cost = [&](int a, Real x, int b, Real y) {
    Vector theta = Vector::Zero(kMaxTheta);
    theta[a] += x;
    theta[b] += y;
    return p.cost(p.moved(theta));
  };
  const ThetaMatrix& H = fit.linearization.H;
  for (int a = 0; a < n; ++a) {
    const double gradient = static_cast<double>(
        derivative([&](Real x) { return cost(a, x, a, 0); }, kSmallStep));
    EXPECT_LT(std::abs(gradient) / std::sqrt(H(a, a)), 1e-8) << a;
    for (int b = a; b < n; ++b)
      expectClose(H(a, b),
                  mixedDerivative([&](Real x, Real y) { return cost(a, x, b, y); }),
                  std::sqrt(H(a, a) * H(b, b)),
                  "H");
  }
}

std::string
caseName(Model model, Residual residual)
{
  constexpr const char* kModels[] = {"Paraboloid", "Sphere", "Cylinder", "Plane"};
  return std::string(kModels[static_cast<int>(model)]) +
         (residual == Residual::Ray ? "Ray" : "Sampson");
}

std::string
kernelCaseName(const testing::TestParamInfo<std::tuple<Model, Residual, double>>& test)
{
  const auto [model, residual, spread] = test.param;
  return caseName(model, residual) + (spread > kNoiseSpread ? "Far" : "Near");
}

std::string
fitCaseName(const testing::TestParamInfo<std::tuple<Model, Residual>>& test)
{
  return caseName(std::get<0>(test.param), std::get<1>(test.param));
}

const auto kModels =
    testing::Values(Model::Paraboloid, Model::Sphere, Model::Cylinder, Model::Plane);
const auto kResiduals = testing::Values(Residual::Sampson, Residual::Ray);

INSTANTIATE_TEST_SUITE_P(All,
                         KernelSums,
                         testing::Combine(kModels,
                                          kResiduals,
                                          testing::Values(kNoiseSpread, kFarSpread)),
                         kernelCaseName);

INSTANTIATE_TEST_SUITE_P(All,
                         FittedSurface,
                         testing::Combine(kModels, kResiduals),
                         fitCaseName);

}}} // namespace holdfast::kernel
