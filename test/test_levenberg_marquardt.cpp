// The minimiser on problems whose solutions are known.
#include "support/random.h"

#include "fit/levenberg_marquardt.h"

#include <limits>

namespace holdfast { namespace {

using Stop = LevenbergMarquardtSummary::Stop;
using Vector2 = Eigen::Vector2d;

struct Evaluation {
  double cost = 0.0;
  Vector2 gradient = Vector2::Zero();
  Eigen::Matrix2d JtJ = Eigen::Matrix2d::Identity();
};

// Least squares over two residuals e(x) with Jacobian J(x).
template <typename Residuals>
struct Problem {
  using State = Vector2;
  static constexpr int kSize = 2;
  using Evaluation = holdfast::Evaluation;

  Residuals residuals; // (x, e, J)

  void evaluate(const State& x, Evaluation& out) const
  {
    Vector2 e;
    Eigen::Matrix2d J;
    residuals(x, e, J);
    out.cost = 0.5 * e.squaredNorm();
    out.gradient = J.transpose() * e;
    out.JtJ = J.transpose() * J;
  }
  State retract(const State& x, const Vector2& step) const
  {
    return x + step;
  }
};

template <typename Residuals>
LevenbergMarquardtSummary
minimised(Residuals residuals,
          Vector2& x,
          const LevenbergMarquardtOptions& options = {})
{
  Evaluation evaluation;
  return levenbergMarquardt(Problem<Residuals>{residuals}, options, x, evaluation);
}

void
linear(const Vector2& x, Vector2& e, Eigen::Matrix2d& J)
{
  J << 2.0, 1.0, -1.0, 3.0;
  e = J * x - Vector2(3.0, 2.0);
}

void
rosenbrock(const Vector2& x, Vector2& e, Eigen::Matrix2d& J)
{
  e << 10.0 * (x[1] - x[0] * x[0]), 1.0 - x[0];
  J << -20.0 * x[0], 10.0, -1.0, 0.0;
}

// A Gauss-Newton step from afar overshoots, farther each time.
void
arcTangent(const Vector2& x, Vector2& e, Eigen::Matrix2d& J)
{
  e << std::atan(x[0]), x[1];
  J << 1.0 / (1.0 + x[0] * x[0]), 0.0, 0.0, 1.0;
}

TEST(LevenbergMarquardt, OneStepSolvesALinearProblem)
{
  Vector2 x(100.0, -50.0);
  const LevenbergMarquardtSummary summary = minimised(linear, x);
  EXPECT_EQ(summary.stop, Stop::Converged);
  EXPECT_EQ(summary.iterations, 1);
  EXPECT_LT((x - Vector2(1.0, 1.0)).norm(), 1e-13);
}

TEST(LevenbergMarquardt, DampingLeadsAlongTheRosenbrockValley)
{
  Vector2 x(-1.2, 1.0);
  LevenbergMarquardtOptions options;
  options.step_tolerance_sigma = 1e-10;
  EXPECT_EQ(minimised(rosenbrock, x, options).stop, Stop::Converged);
  EXPECT_LT((x - Vector2(1.0, 1.0)).norm(), 1e-8);
}

TEST(LevenbergMarquardt, DampingStopsOvershooting)
{
  Vector2 x(20.0, 1.0);
  EXPECT_EQ(minimised(arcTangent, x).stop, Stop::Converged);
  EXPECT_LT(x.norm(), 1e-4);
}

TEST(LevenbergMarquardt, StopsAtTheIterationLimitWithTheBestState)
{
  Vector2 x(-1.2, 1.0);
  LevenbergMarquardtOptions options;
  options.max_iterations = 3;
  const LevenbergMarquardtSummary summary = minimised(rosenbrock, x, options);
  EXPECT_EQ(summary.stop, Stop::IterationLimit);
  EXPECT_EQ(summary.iterations, 3);
  Evaluation start, end;
  const Problem<decltype(&rosenbrock)> problem{rosenbrock};
  problem.evaluate(Vector2(-1.2, 1.0), start);
  problem.evaluate(x, end);
  EXPECT_LT(end.cost, start.cost);
}

TEST(LevenbergMarquardt, AParameterWithoutInfluenceIsSingular)
{
  Vector2 x(1.0, 1.0);
  const auto flat = [](const Vector2& at, Vector2& e, Eigen::Matrix2d& J) {
    e << at[0], 0.0;
    J << 1.0, 0.0, 0.0, 0.0;
  };
  EXPECT_EQ(minimised(flat, x).stop, Stop::Singular);
}

TEST(LevenbergMarquardt, ACostThatIsNoNumberIsReported)
{
  Vector2 x(1.0, 1.0);
  const auto broken = [](const Vector2&, Vector2& e, Eigen::Matrix2d& J) {
    e.setConstant(std::numeric_limits<double>::quiet_NaN());
    J.setIdentity();
  };
  EXPECT_EQ(minimised(broken, x).stop, Stop::NonFinite);
}

// A step into a region without a cost must be taken back, not taken for progress.
TEST(LevenbergMarquardt, RetreatsFromWhereTheCostIsNoNumber)
{
  const auto walled = [](const Vector2& at, Vector2& e, Eigen::Matrix2d& J) {
    arcTangent(at, e, J);
    if (std::abs(at[0]) > 5.0)
      e.setConstant(std::numeric_limits<double>::quiet_NaN());
  };
  Vector2 x(3.0, 0.0);
  EXPECT_EQ(minimised(walled, x).stop, Stop::Converged);
  EXPECT_LT(x.norm(), 1e-4);
}

}} // namespace holdfast
