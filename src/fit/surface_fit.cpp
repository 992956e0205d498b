#include "surface_fit.h"
#include "levenberg_marquardt.h"
#include <holdfast/geometry/rotation.h>

#include "fit/models/models.h"
#include "geometry/small_cholesky.h"
#include "geometry/symmetric.h"
#include "geometry/symmetric_eigen.h"
#include "parallel/thread_memory.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <vector>

namespace holdfast {
namespace {

using kernel::Model;
using kernel::Precision;
using Matrix36 = Eigen::Matrix<double, 3, 6>;

// Pivots of the normal equations scaled to unit diagonal: the share of a parameter's
// information that the others do not explain. Below 1e-10 it is rounding: the float
// coordinates of a cloud carry 7 digits, and the pivot is of second order in them.
constexpr double kSmallestPivot = 1e-10;

// Single precision leaves some 1e-7 of a parameter's information; of what the others do
// not explain, this is the least share in which a ten-thousandth of the covariance can
// be had.
constexpr double kSmallestSinglePivot = 1e-3;

// Costs that differ by less are equal within rounding.
constexpr double
costRounding(Precision precision)
{
  return precision == Precision::Single ? 1e-6 : 1e-12;
}

// Whoever asks for more digits than the options' defaults gets them; so does who has
// the covariance made of two fits, whose terms cancel.
Precision
precisionFor(const FitOptions& options, const kernel::Points& points)
{
  const bool defaults_will_do =
      options.polish_tolerance_sigma >= FitOptions().polish_tolerance_sigma;
  return defaults_will_do && options.normal_from_pca &&
                 points.padded_size <= kernel::kMostInSingle ?
             Precision::Single :
             Precision::Double;
}

// Exact Newton steps at the end; each squares the error, so more than a few mean
// trouble.
constexpr int kMaxPolishSteps = 12;

// E_theta, zero on padding.
Theta
gradientOf(Model model, const double gradient[])
{
  Theta result = Theta::Zero();
  std::copy_n(gradient, kernel::parameterCount(model), result.data());
  return result;
}

// The weighted least-squares problem of one surface, as levenbergMarquardt() wants it.
struct SurfaceProblem {
  using State = UnboundedSurface;
  static constexpr int kSize = kernel::kMaxTheta;
  struct Evaluation {
    double cost = 0.0;
    Theta gradient = Theta::Zero();
    ThetaMatrix JtJ = ThetaMatrix::Identity();
  };

  Precision precision;
  Model model;
  Residual residual;
  kernel::Points points;
  const Scatter& scatter;
  const PointBatch& batch;
  const PatternSupport& support;

  void evaluate(const State& state, Evaluation& evaluation) const
  {
    kernel::NormalSums sums;
    kernel::kernel().accumulateNormal(precision,
                                      model,
                                      residual,
                                      points,
                                      kernelState(state, scatter),
                                      sums);
    evaluation.cost = sums.cost;
    evaluation.gradient = gradientOf(model, sums.gradient);
    evaluation.JtJ.setIdentity();
    const int n = kernel::parameterCount(model);
    for (int a = 0, entry = 0; a < n; ++a)
      for (int b = a; b < n; ++b, ++entry)
        evaluation.JtJ(a, b) = evaluation.JtJ(b, a) = sums.JtJ[entry];
  }

  State retract(const State& state, const Theta& step) const
  {
    return retractedSurface(state, scatter, step);
  }
};

// Units that bring the normal equations to unit diagonal. For rotations none larger
// than a radian: of points on a line, rounding knows the turn about it to 1e12 radians
// or so.
Theta
unitScale(const ThetaMatrix& H, Model model)
{
  const int n = kernel::parameterCount(model);
  const int shape = kernel::shapeParameterCount(model);
  const int first_rotation = withModel(model, [](auto m) { return m.kFirstRotation; });
  Theta scale = Theta::Ones();
  for (int i = 0; i < n; ++i) {
    const bool rotation = i >= first_rotation && i < shape;
    const double information = rotation ? std::max(H(i, i), 1.0) : H(i, i);
    scale[i] = information > 0.0 ? 1.0 / std::sqrt(information) : 1.0;
  }
  return scale;
}

// Cholesky factors of normal equations scaled to unit diagonal.
class ScaledCholesky {
public:
  ScaledCholesky(const ThetaMatrix& H, Model model)
  : scale_(unitScale(H, model)), cholesky_(scaled(H))
  {}

  // 0 when the matrix is not positive definite: then there is nothing to solve.
  double smallestPivot() const
  {
    return cholesky_.smallestPivot();
  }

  Theta solve(const Theta& b) const
  {
    return scale_.cwiseProduct(cholesky_.solve(scale_.cwiseProduct(b)));
  }

private:
  ThetaMatrix scaled(const ThetaMatrix& H) const
  {
    ThetaMatrix S;
    for (int j = 0; j < kernel::kMaxTheta; ++j)
      for (int i = 0; i < kernel::kMaxTheta; ++i)
        S(i, j) = scale_[i] * H(i, j) * scale_[j];
    return S;
  }

  Theta scale_;
  SmallCholesky<kernel::kMaxTheta> cholesky_;
};

// Undetermined directions: eigenvectors of the scaled normal equations, of which there
// is at least one where the smallest pivot is too small.
NullSpace
nullSpaceOf(const ThetaMatrix& H, Model model)
{
  const Theta scale = unitScale(H, model);
  const SymmetricEigen eigen =
      symmetricEigen(scale.asDiagonal() * H * scale.asDiagonal());
  NullSpace space(6, 0);
  for (int i = 0; i < 6; ++i) {
    if (eigen.values[i] > kSmallestPivot)
      break;
    const Theta direction = scale.cwiseProduct(eigen.vectors.col(i));
    space.conservativeResize(6, space.cols() + 1);
    space.col(space.cols() - 1) = direction.normalized();
  }
  return space;
}

// Hessian: shape block from the sums; columns of translations along d are -sum X_i d,
// since the cost depends on q - c alone.
ThetaMatrix
hessian(const UnboundedSurface& surface,
        const Scatter& scatter,
        const kernel::CovarianceSums& sums)
{
  const int shape = kernel::shapeParameterCount(surface.model);
  const int n = kernel::parameterCount(surface.model);
  ThetaMatrix H = ThetaMatrix::Identity();
  for (int a = 0, entry = 0; a < shape; ++a)
    for (int b = a; b < shape; ++b, ++entry)
      H(a, b) = sums.H[entry];
  withModel(surface.model, [&](auto m) { m.addCurvatureTerms(surface, sums.L, H); });
  const Eigen::Matrix3d directions = withModel(surface.model, [&](auto m) {
    return m.translations(surface, scatter);
  });
  const auto T = crossSumMatrix(sums, n);
  for (int i = shape; i < n; ++i)
    H.col(i).head(n) = -T.topRows(n) * directions.col(i - shape);
  for (int a = 0; a < n; ++a)
    for (int b = a + 1; b < n; ++b)
      H(b, a) = H(a, b);
  return H;
}

// Covariance of the moments. D_i: mean I/N, scatter bc (qt_b e_c + qt_c e_b)/N.
MomentMatrix
momentCovariance(const kernel::CovarianceSums& sums, int count)
{
  using symmetric::kColumn, symmetric::kIndex, symmetric::kRow;
  const double scale = 1.0 / (static_cast<double>(count) * count);
  MomentMatrix DD;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      DD(i, j) = sums.S[kIndex[i][j]] * scale;
  for (int e = 0; e < 6; ++e) {
    const int b = kRow[e], c = kColumn[e];
    for (int i = 0; i < 3; ++i)
      DD(i, 3 + e) = DD(3 + e, i) =
          (sums.qS[b][kIndex[c][i]] + sums.qS[c][kIndex[b][i]]) * scale;
    for (int o = e; o < 6; ++o) {
      const int d = kRow[o], f = kColumn[o];
      DD(3 + e, 3 + o) = DD(3 + o, 3 + e) =
          (sums.qqS[kIndex[b][d]][kIndex[c][f]] + sums.qqS[kIndex[b][f]][kIndex[c][d]] +
           sums.qqS[kIndex[c][d]][kIndex[b][f]] +
           sums.qqS[kIndex[c][f]][kIndex[b][d]]) *
          scale;
    }
  }
  return DD;
}

void
linearize(const UnboundedSurface& surface,
          const Scatter& scatter,
          const kernel::CovarianceSums& sums,
          Linearization& result)
{
  const int n = kernel::parameterCount(surface.model);
  result.H = hessian(surface, scatter, sums);
  result.A = withModel(surface.model,
                       [&](auto m) { return m.momentCross(surface, scatter, sums); });
  const double inverse_count = 1.0 / scatter.count;
  for (int a = 0, entry = 0; a < n; ++a) {
    for (int b = a; b < n; ++b, ++entry)
      result.XX(a, b) = result.XX(b, a) = sums.XX[entry];
    for (int i = 0; i < 3; ++i)
      result.XD(a, i) = sums.XS[a][i] * inverse_count;
    for (int e = 0; e < 6; ++e)
      result.XD(a, 3 + e) = sums.XSq[a][e] * inverse_count;
  }
  result.DD = momentCovariance(sums, scatter.count);
}

FitStatus
statusOf(LevenbergMarquardtSummary::Stop stop)
{
  using Stop = LevenbergMarquardtSummary::Stop;
  switch (stop) {
  case Stop::Converged:
    return FitStatus::Converged;
  case Stop::IterationLimit:
    return FitStatus::IterationLimit;
  case Stop::Singular:
    return FitStatus::Degenerate;
  case Stop::NonFinite:
    break;
  }
  return FitStatus::NonFinite;
}

// The kernel's covariance sums, with what errors that points share need.
class CovariancePass {
public:
  explicit CovariancePass(const SurfaceProblem& problem)
  : problem_(problem), points_(problem.points)
  {
    const CorrelatedNoise* shared = problem.batch.pattern();
    if (shared == nullptr || shared->variance() == 0.0)
      return;
    pattern_ = kernelPattern(problem.batch);
    pattern_.grid = problem.support.grid();
    pattern_.cells = &cells_;
    points_.pattern = &pattern_;
  }

  CovariancePass(const CovariancePass&) = delete;
  CovariancePass& operator=(const CovariancePass&) = delete;

  void run(const UnboundedSurface& surface, kernel::CovarianceSums& sums) const
  {
    accumulate(points_, surface, sums);
  }

  // What errors make that points do not share: of every point's variance, the pattern's
  // is taken away.
  Linearization white(const UnboundedSurface& surface) const
  {
    kernel::CovarianceSums sums;
    Linearization result;
    if (points_.pattern == nullptr) {
      run(surface, sums);
      linearize(surface, problem_.scatter, sums, result);
      return result;
    }
    // Aligned as the kernel loads it.
    struct alignas(64) Lanes {
      double value[PointBatch::kLaneMultiple];
    };
    Lanes lanes;
    std::fill(std::begin(lanes.value),
              std::end(lanes.value),
              -problem_.batch.pattern()->variance());
    const std::vector<Lanes> less(
        static_cast<std::size_t>(points_.padded_size / PointBatch::kLaneMultiple),
        lanes);
    kernel::PatternPoints pattern = pattern_;
    pattern.extra = less.front().value;
    pattern.cells = nullptr;
    kernel::Points points = points_;
    points.pattern = &pattern;
    accumulate(points, surface, sums);
    linearize(surface, problem_.scatter, sums, result);
    return result;
  }

  // After the last run.
  void addPattern(Linearization& linearization)
  {
    linearization.has_pattern = points_.pattern != nullptr;
    if (linearization.has_pattern)
      linearization.pattern =
          problem_.support.sum(*problem_.batch.pattern(), problem_.precision, cells_);
  }

private:
  void accumulate(const kernel::Points& points,
                  const UnboundedSurface& surface,
                  kernel::CovarianceSums& sums) const
  {
    kernel::kernel().accumulateCovariance(problem_.precision,
                                          problem_.model,
                                          problem_.residual,
                                          points,
                                          kernelState(surface, problem_.scatter),
                                          sums);
  }

  const SurfaceProblem& problem_;
  kernel::Points points_;
  kernel::PatternPoints pattern_{};
  kernel::CellSums cells_; // where there is a pattern
};

// tr(H^-1 Cov(E_theta)): how much of chi2 the surface takes up on average.
double
takenUp(const Linearization& l, const ThetaMatrix& inverse)
{
  const ThetaMatrix gradient = l.XX + l.pattern.topLeftCorner<6, 6>();
  return inverse.cwiseProduct(gradient).sum();
}

// Points moved onto a plane or paraboloid along the axis of its frame, where they
// always meet it.
void
moveOnto(const UnboundedSurface& surface,
         const kernel::Points& points,
         double* const out[3])
{
  const Eigen::Vector3d k =
      surface.model == Model::Plane ? Eigen::Vector3d::Zero() : surface.k;
  for (int i = 0; i < points.padded_size; ++i) {
    const Eigen::Vector3d point(points.channel[0][i],
                                points.channel[1][i],
                                points.channel[2][i]);
    Eigen::Vector3d q = surface.R.transpose() * (point - surface.c);
    q.z() = 0.5 * (k[0] * q.x() * q.x() + k[2] * q.y() * q.y()) + k[1] * q.x() * q.y();
    const Eigen::Vector3d moved = surface.c + surface.R * q;
    for (int axis = 0; axis < 3; ++axis)
      out[axis][i] = moved[axis];
  }
}

// The same at points without residuals.
double
takenUpWithoutResiduals(const SurfaceProblem& problem, const UnboundedSurface& surface)
{
  auto& moved = threadMemory<PaddedRows, struct MovedPoints>();
  moved.resize(3, problem.points.padded_size);
  double* const onto[3] = {moved.row(0), moved.row(1), moved.row(2)};
  moveOnto(surface, problem.points, onto);
  SurfaceProblem ideal = problem;
  ideal.precision = Precision::Double; // what residuals do not determine is not much
  std::copy_n(onto, 3, ideal.points.channel);
  CovariancePass pass(ideal);
  kernel::CovarianceSums sums;
  Linearization linearization;
  pass.run(surface, sums);
  linearize(surface, problem.scatter, sums, linearization);
  pass.addPattern(linearization);
  return takenUp(linearization, symmetricInverse(linearization.H));
}

// Residuals of the size of the surface's own curvature reach into H and the X_i: chi2
// would then be taken up by what is none of its mean, more of it than there is. It
// shows where the Gauss-Newton part of H is not all of it, in units of the parameters'
// sigmas.
double
meanTakenUp(const SurfaceProblem& problem, const SurfaceFit& fit)
{
  constexpr double kSmall = 0.1; // rms over the parameters
  const Linearization& l = fit.linearization;
  const ThetaMatrix inverse = symmetricInverse(l.H);
  const ThetaMatrix rest = inverse.lazyProduct(fit.JtJ) - ThetaMatrix::Identity();
  const double squared = rest.cwiseProduct(rest.transpose()).sum();
  const bool is_quadric =
      problem.model == Model::Paraboloid || problem.model == Model::Plane;
  const double taken_up = takenUp(l, inverse);
  if (!is_quadric || (squared < kernel::kMaxTheta * kSmall * kSmall &&
                      taken_up < problem.scatter.count))
    return taken_up;
  // Which takes up too little of them, but never all.
  constexpr double kLeastLeft = 0.5;
  const double ideal = takenUpWithoutResiduals(problem, fit.surface);
  const double left = problem.scatter.count - taken_up;
  const double left_by_ideal = problem.scatter.count - ideal;
  return left < kLeastLeft * left_by_ideal ? ideal : taken_up;
}

// Exact Newton steps; the sums of the last one also give the covariance. Newton is
// blind to the cost: where it climbs away from the start, the start is kept.
void
polish(const SurfaceProblem& problem, const FitOptions& options, SurfaceFit& fit)
{
  // More than rounding, less than matters: half a unit of chi-square.
  constexpr double kClimb = 0.25;
  const UnboundedSurface start = fit.surface;
  const double start_cost = fit.cost;
  CovariancePass pass(problem);
  kernel::CovarianceSums sums;
  for (fit.polish_steps = 1; fit.polish_steps <= kMaxPolishSteps; ++fit.polish_steps) {
    pass.run(fit.surface, sums);
    linearize(fit.surface, problem.scatter, sums, fit.linearization);
    fit.cost = sums.cost;
    if (!fit.linearization.H.allFinite()) {
      fit.status = FitStatus::NonFinite;
      return;
    }
    if (sums.cost > start_cost + kClimb)
      break;
    const ScaledCholesky cholesky(fit.linearization.H, problem.model);
    fit.smallest_pivot = cholesky.smallestPivot();
    if (cholesky.smallestPivot() < kSmallestPivot) {
      fit.status = FitStatus::Degenerate;
      fit.null_space = nullSpaceOf(fit.linearization.H, problem.model);
      return;
    }
    const Theta gradient = gradientOf(problem.model, sums.gradient);
    const Theta step = -cholesky.solve(gradient);
    const bool arrived =
        std::sqrt(std::max(0.0, -step.dot(gradient))) < options.polish_tolerance_sigma;
    if (arrived)
      pass.addPattern(fit.linearization);
    if (arrived && options.separate_pattern)
      fit.white = pass.white(fit.surface);
    if (arrived && fit.linearization.has_pattern)
      fit.taken_up = meanTakenUp(problem, fit);
    fit.surface = retractedSurface(fit.surface, problem.scatter, step);
    if (arrived) {
      fit.status = FitStatus::Converged;
      return;
    }
  }
  fit.surface = start;
  fit.cost = start_cost;
  fit.status = FitStatus::IterationLimit;
}

// Principal axes of the scatter, the normal on the side of `towards`.
void
setAxes(const Eigen::Vector3d& towards, Scatter& scatter)
{
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(scatter.covariance);
  scatter.eigenvalues = solver.eigenvalues();
  const Eigen::Vector3d n = solver.eigenvectors().col(0);
  scatter.axes.col(2) = n.dot(towards) < 0.0 ? Eigen::Vector3d(-n) : n;
  scatter.axes.col(0) = solver.eigenvectors().col(2);
  scatter.axes.col(1) = scatter.axes.col(2).cross(scatter.axes.col(0));
}

// Brings the surface near the solution by the Sampson residual: cheaper than the ray
// residual and, where rays from a poor start would miss the surface, with fewer false
// minima. The two solutions are within half a sigma of each other.
// \return iterations.
int
approach(SurfaceProblem problem, const FitOptions& options, UnboundedSurface& surface)
{
  // Gauss-Newton leaves a hundredth of a step: one this long, in sigmas, needs no
  // check.
  constexpr double kNear = 2.0;
  problem.residual = Residual::Sampson;
  SurfaceProblem::Evaluation evaluation;
  return levenbergMarquardt(
             problem,
             {options.max_iterations, kNear, costRounding(problem.precision)},
             surface,
             evaluation)
      .iterations;
}

// Damped Gauss-Newton steps, then exact Newton steps, from fit.surface.
void
descend(const SurfaceProblem& problem, const FitOptions& options, SurfaceFit& fit)
{
  SurfaceProblem::Evaluation evaluation;
  const LevenbergMarquardtOptions lm{options.max_iterations,
                                     options.step_tolerance_sigma,
                                     costRounding(problem.precision)};
  const auto summary = levenbergMarquardt(problem, lm, fit.surface, evaluation);
  fit.iterations += summary.iterations;
  fit.status = statusOf(summary.stop);
  fit.cost = evaluation.cost;
  fit.JtJ = evaluation.JtJ;
  if (!evaluation.JtJ.allFinite())
    fit.status = FitStatus::NonFinite;
  if (fit.status != FitStatus::NonFinite &&
      ScaledCholesky(evaluation.JtJ, problem.model).smallestPivot() < kSmallestPivot) {
    fit.status = FitStatus::Degenerate;
    fit.null_space = nullSpaceOf(evaluation.JtJ, problem.model);
  }
  // Where residuals are large, Gauss-Newton may circle the minimum that Newton then
  // finds.
  if (fit.status == FitStatus::Converged || fit.status == FitStatus::IterationLimit)
    polish(problem, options, fit);
}

// Of two fits to the same points; the former one where they agree within rounding.
bool
isBetter(const SurfaceFit& later, const SurfaceFit& former)
{
  constexpr double kRounding = 1e-6; // of half a chi-square
  const bool converged = later.status == FitStatus::Converged;
  if (converged != (former.status == FitStatus::Converged))
    return converged;
  return later.cost < former.cost - kRounding;
}

// Spheres and cylinders of which much more than a cap is seen. Every ray that meets a
// ball meets a larger one through the same apex; past a smaller one they go, and a fit
// that starts there may never find them again. So start from flatter surfaces, two of
// them, since the cost has several minima where rays graze the silhouette.
SurfaceFit
fitThick(const SurfaceProblem& problem,
         const FitOptions& options,
         const UnboundedSurface& start)
{
  const auto fitFlattened = [&](double share_of_curvature) {
    SurfaceFit fit;
    fit.surface = start;
    fit.surface.k *= share_of_curvature;
    descend(problem, options, fit);
    return fit;
  };
  const SurfaceFit steeper = fitFlattened(0.8), flatter = fitFlattened(0.65);
  return isBetter(flatter, steeper) ? flatter : steeper;
}

SurfaceFit
fitFrom(const UnboundedSurface& start,
        const SurfaceProblem& problem,
        const FitOptions& options)
{
  if (wraps(problem.model) && isThick(problem.scatter))
    return fitThick(problem, options, start);
  SurfaceFit fit;
  fit.surface = start;
  if (options.residual == Residual::Ray && problem.model != Model::Plane)
    fit.iterations = approach(problem, options, fit.surface);
  descend(problem, options, fit);
  return fit;
}

} // namespace

Eigen::Matrix<double, kernel::kMaxTheta, 3>
crossSumMatrix(const kernel::CovarianceSums& sums, int n)
{
  Eigen::Matrix<double, kernel::kMaxTheta, 3> T;
  T.setZero();
  for (int a = 0; a < n; ++a)
    for (int i = 0; i < 3; ++i)
      T(a, i) = sums.X[a][i];
  return T;
}

UnboundedSurface
retractedSurface(const UnboundedSurface& surface,
                 const Scatter& scatter,
                 const Theta& step)
{
  return withModel(surface.model,
                   [&](auto m) { return m.retracted(surface, scatter, step); });
}

kernel::Points
kernelPoints(const PointBatch& batch)
{
  kernel::Points points;
  for (int i = 0; i <= PointBatch::W; ++i)
    points.channel[i] = batch.channel(static_cast<PointBatch::Channel>(i));
  points.padded_size = batch.paddedSize();
  return points;
}

kernel::PatternPoints
kernelPattern(const PointBatch& batch)
{
  return {{batch.channel(PointBatch::U), batch.channel(PointBatch::V)},
          {batch.channel(PointBatch::EX),
           batch.channel(PointBatch::EY),
           batch.channel(PointBatch::EZ)},
          batch.channel(PointBatch::EXTRA),
          {},
          1.0 / batch.size(),
          nullptr};
}

kernel::State
kernelState(const UnboundedSurface& surface, const Scatter& scatter)
{
  kernel::State state;
  const Eigen::Vector3d line = surface.R.transpose() * scatter.normal();
  const Eigen::Vector3d centroid = surface.R.transpose() * (scatter.mean - surface.c);
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j)
      state.R[3 * i + j] = surface.R(i, j);
    state.c[i] = surface.c[i];
    state.k[i] = surface.k[i];
    state.line[i] = line[i];
    state.centroid[i] = centroid[i];
  }
  return state;
}

Scatter
measureScatter(const PointBatch& batch, bool debias, const Eigen::Vector3d& viewpoint)
{
  kernel::ScatterSums sums;
  kernel::kernel().accumulateScatter(kernelPoints(batch), sums);
  Scatter scatter;
  scatter.count = batch.size();
  const double inverse = 1.0 / scatter.count;
  using symmetric::kIndex;
  for (int i = 0; i < 3; ++i)
    scatter.mean[i] = sums.q[i] * inverse;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      scatter.covariance(i, j) =
          sums.qq[kIndex[i][j]] * inverse - scatter.mean[i] * scatter.mean[j];
      if (debias)
        scatter.covariance(i, j) -= sums.sigma[kIndex[i][j]] * inverse;
    }
  setAxes(viewpoint - scatter.mean, scatter);
  return scatter;
}

Scatter
withMoments(const Scatter& scatter,
            const Eigen::Vector3d& mean,
            const Eigen::Matrix3d& covariance)
{
  Scatter moved = scatter;
  moved.mean = mean;
  moved.covariance = covariance;
  setAxes(scatter.normal(), moved);
  return moved;
}

Eigen::Matrix3d
normalDerivative(const Eigen::Matrix3d& C, const Eigen::Vector3d& n)
{
  const Eigen::Matrix<double, 3, 2> B = frameFromZ(n).leftCols<2>();
  const Eigen::Matrix2d gap =
      n.dot(C * n) * Eigen::Matrix2d::Identity() - B.transpose() * C * B;
  return B * gap.inverse() * B.transpose();
}

Matrix36
normalJacobian(const Eigen::Matrix3d& C, const Eigen::Vector3d& n)
{
  const Eigen::Matrix3d P = normalDerivative(C, n);
  Matrix36 J;
  J.col(0) = P.col(0) * n[0];
  J.col(1) = P.col(0) * n[1] + P.col(1) * n[0];
  J.col(2) = P.col(0) * n[2] + P.col(2) * n[0];
  J.col(3) = P.col(1) * n[1];
  J.col(4) = P.col(1) * n[2] + P.col(2) * n[1];
  J.col(5) = P.col(2) * n[2];
  return J;
}

SurfaceFit
fitSurface(kernel::Model model,
           const PointBatch& batch,
           const Scatter& scatter,
           const PatternSupport& support,
           const FitOptions& options,
           Precision coarsest)
{
  const kernel::Points points = kernelPoints(batch);
  const UnboundedSurface start = withModel(model, [&](auto m) {
    return m.start({options.residual, points, scatter});
  });
  SurfaceProblem problem{std::max(coarsest, precisionFor(options, points)),
                         model,
                         options.residual,
                         points,
                         scatter,
                         batch,
                         support};
  SurfaceFit fit = fitFrom(start, problem, options);
  const bool is_enough =
      fit.status == FitStatus::Converged && fit.smallest_pivot >= kSmallestSinglePivot;
  if (problem.precision == Precision::Single && !is_enough) {
    problem.precision = Precision::Double;
    fit = fitFrom(start, problem, options);
  }
  fit.precision = problem.precision;
  return fit;
}

ThetaMatrix
symmetricInverse(const ThetaMatrix& H)
{
  return SmallCholesky<kernel::kMaxTheta>(H).inverse();
}

namespace {

// Of E_theta + A ds. lazyProduct: for matrices this small Eigen's blocked product costs
// more than the work.
ThetaMatrix
gradientCovariance(const ThetaMatrix& XX,
                   const ThetaByMoments& XD,
                   const MomentMatrix& DD,
                   const ThetaByMoments& A)
{
  const ThetaByMoments half = XD + 0.5 * A.lazyProduct(DD);
  const ThetaMatrix cross = half.lazyProduct(A.transpose());
  return XX + cross + cross.transpose();
}

} // namespace

ThetaMatrix
thetaCovariance(const Linearization& l, const ThetaMatrix& hessian)
{
  constexpr int p = kernel::kMaxTheta;
  const ThetaMatrix gradient =
      l.has_pattern ?
          gradientCovariance(l.XX + l.pattern.topLeftCorner<p, p>(),
                             l.XD + l.pattern.topRightCorner<p, kMoments>(),
                             l.DD + l.pattern.bottomRightCorner<kMoments, kMoments>(),
                             l.A) :
          gradientCovariance(l.XX, l.XD, l.DD, l.A);
  const ThetaMatrix inverse = symmetricInverse(hessian);
  return inverse.lazyProduct(ThetaMatrix(gradient.lazyProduct(inverse)));
}

} // namespace holdfast
