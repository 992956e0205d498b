/// \file The hot path: sums over the points of one neighbourhood.
///
/// Raw pointers and plain structs only. The per-point mathematics is written once, for
/// any number type: `double` gives the readable reference, vectors of doubles and
/// floats the fast version, chosen at run time. It starts with the surfaces
/// (src/fit/kernel_surface.inl), goes on to an evaluation (kernel_evaluation.inl) and
/// the covariance pass (kernel_foot.inl; where rays all but miss, kernel_point.inl).
/// Everything on the sums is ordinary C++ elsewhere.
///
/// Notation, in the local frame q = R^T (q_world - c), Sigma = R^T Sigma_world R:
///
///     f = q^T G q / 2 - 2 z        implicit form, G = 2K
///     g = df/dq = G q - 2 e_z      t = Sigma g      V = g.t      w = t^T G t / 2
///
/// The cost of a point is E(f, V, w): with the Sampson residual f^2/(2V), with the ray
/// residual the halved squared Mahalanobis distance along t, whose foot q - s t solves
/// f - s V + s^2 w = 0. Every derivative follows by the chain rule through f, V, w:
///
///     f_a               V_a = 2 B_a.t                 w_a = B_a.r + t^T G_a t / 2
///     f_q = g           V_q = 2 G t                   w_q = G r          r = Sigma G t
///
/// with B_a = dg/dtheta_a and G_a = dG/dtheta_a. Second derivatives of f with respect
/// to the parameters are polynomials p(q) of degree two at most, and enter through the
/// functional L[p] = sum( E_f p + grad p.(2 E_V t + E_w r) + E_w t^T (hess p) t / 2 ),
/// that is, through ten sums. The gradient is L[f_a].
#pragma once

#include "patch/boundary_form.h"

#include <holdfast/fit/options.h>

#include <cstdint>
#include <vector>

namespace holdfast { namespace kernel {

/// Surfaces as the solver sees them, and their minimal parameters theta (shape
/// parameters first, then translations of c along directions fixed in the local frame):
///   Paraboloid  kxx kxy kyy, delta_x delta_y, a (along the line of the centre)
///   Sphere      k, c_x c_y c_z
///   Cylinder    k, delta_y delta_z, c_y c_z (axis: local x)
///   Plane       delta_x delta_y, c_z
/// delta is a perturbation R <- R Exp(delta).
enum class Model : std::uint8_t { Paraboloid, Sphere, Cylinder, Plane };

inline constexpr int kMaxTheta = 6;

/// How many parameters a model has, in the order of the enumeration.
struct ModelSize {
  int parameters;
  int shape_parameters;
};
inline constexpr ModelSize kModelSizes[] = {{6, 5}, {4, 1}, {5, 3}, {3, 2}};

constexpr int
parameterCount(Model model)
{
  return kModelSizes[static_cast<int>(model)].parameters;
}

constexpr int
shapeParameterCount(Model model)
{
  return kModelSizes[static_cast<int>(model)].shape_parameters;
}

/// Index of entry (row, column), row <= column, in a packed upper triangle of size n.
constexpr int
packed(int row, int column, int n)
{
  return row * n - row * (row - 1) / 2 + column - row;
}

/// A square grid of cells, row by row, with kCellRow numbers each.
inline constexpr int kCells = 8; ///< along a side; even
inline constexpr int kCellRow = 16; ///< a multiple of every vector
struct CellSums {
  alignas(64) double y[kCells * kCells][kCellRow];
  /// Of two cells, by how many rows and columns they are apart.
  double covariance[kCells][kCells];
};

/// Where in the image the cells are.
struct CellGrid {
  double corner[2];
  double inverse_side;
};

/// Points that share errors (fit/pattern.h).
struct PatternPoints {
  const double* pixel[2]; ///< u, v
  const double* direction[3]; ///< r_i, how point i moves with its shared error
  const double* extra; ///< variance along r_i that the sums count beside Sigma_i
  CellGrid grid;
  double per_count; ///< 1/N
  /// Where the covariance pass sums y_i of the points, cell by cell: X_i r_i
  /// (kMaxTheta), then r_i/N and the (qt_b r_c + qt_c r_b)/N of bc = xx xy xz yy yz zz,
  /// in the local frame; null: it does not.
  CellSums* cells;
};

/// Where the points are: channels in the order of PointBatch::Channel.
struct Points {
  const double* channel[10];
  int padded_size; ///< multiple of PointBatch::kLaneMultiple
  const PatternPoints* pattern = nullptr; ///< null: all errors are independent
};

/// Surface at which the sums are taken; coordinates relative to the batch's origin.
struct State {
  double R[9]; ///< row-major, local to world
  double c[3]; ///< origin of the local frame
  double k[3]; ///< paraboloid kxx kxy kyy; sphere, cylinder k 0 0; plane unused
  double line[3]; ///< paraboloid: unit direction of the line of c, local frame
  double centroid[3]; ///< mean of the points, local frame (accumulateCovariance only)
};

/// Moments of the points; symmetric matrices as xx xy xz yy yz zz.
struct ScatterSums {
  double q[3];
  double qq[6];
  double sigma[6];
};

/// Moments for the least-squares quadric z(x, y) over a given frame.
struct QuadricSums {
  /// sum x^i y^j in the order 1, x, y, xx, xy, yy, xxx, xxy, xyy, yyy, x4, x3y, x2y2,
  /// xy3, y4
  double monomial[15];
  double z[6]; ///< sum z times 1, x, y, xx, xy, yy
};

/// L of 1 x y z xx yy zz xy xz yz.
enum Polynomial { P1, PX, PY, PZ, PXX, PYY, PZZ, PXY, PXZ, PYZ, kPolynomials };

/// One damped Gauss-Newton iteration's sums.
struct NormalSums {
  double cost;
  double gradient[kMaxTheta]; ///< E_theta = L[f_theta]
  double JtJ[21]; ///< packed upper triangle of size parameterCount
};

/// Sums of the exact covariance. X_i = d^2E / dtheta dq_i is p x 3, in the local frame;
/// symmetric index pairs in the order xx xy xz yy yz zz; qt = q - centroid. Where
/// points share errors, Sigma_i stands for Sigma_i + extra_i r_i r_i^T; the cost and
/// its derivatives know nothing of it.
struct CovarianceSums {
  double cost;
  double gradient[kMaxTheta];
  double L[kPolynomials];
  double H[15]; ///< packed, shape parameters; without the L[f_ab] part
  double X[kMaxTheta][3]; ///< sum X_i
  double XX[21]; ///< sum X_i Sigma_i X_i^T, packed
  double XS[kMaxTheta][3]; ///< sum X_i Sigma_i
  double XSq[kMaxTheta][6]; ///< sum (X_i Sigma_i)_a (qt_b e_c + qt_c e_b): covariance
                            ///< with the scatter entries bc (b == c: 2 qt_b e_b), x N
  double S[6]; ///< sum Sigma_i
  double qS[3][6]; ///< sum qt_a (Sigma_i)_bc
  double qqS[6][6]; ///< sum qt_a qt_b (Sigma_i)_cd
};

/// How many points from the first on are surely valid: finite coordinates, pixels and
/// directions, and a positive definite covariance. The next ones need a closer look.
int countLeadingValid(const Points& points);

namespace reference {
int countLeadingValid(const Points& points);
} // namespace reference

/// What the sums are taken in. In single precision the coordinates in the frame, f, the
/// cost and L, whose terms cancel, are doubles all the same; sums are right to some
/// 1e-6 of the largest of their kind, for points up to kMostInSingle.
enum class Precision : std::uint8_t { Single, Double }; // the finer, the larger

/// Beyond these, running sums in single precision lose more digits than one.
inline constexpr int kMostInSingle = 4096;

/// A bounded patch, coordinates relative to the batch's origin.
struct PatchForm {
  double R[9]; ///< row-major, local to world
  double c[3];
  double k[3]; ///< diagonal of K (patch/surface.h)
  BoundaryForm boundary;
};

/// Of every point, padding included: its local coordinates, how far out they are
/// (BoundaryForm), its squared distance to the unbounded surface along the gradient at
/// the point (validation/residual.h), and the variance of its error along local z.
struct PlacedPoints {
  double* q[3];
  double* reach;
  double* squared_distance;
  double* variance;
};

/// Where the pixels of the points are, padding left out of the sums.
struct PixelSums {
  double low[2], high[2];
  double sum[2]; ///< sums are of the distances from a given pixel
  double squares[3]; ///< uu uv vv
};

/// How much the neighbours of a point add to its variance: `whole` where it has all of
/// them, less at the edge of the support, which is an ellipse; `less` is taken off.
struct NeighborVariance {
  double middle[2];
  double to_disc[3]; ///< lower triangle 00 10 11 that makes it the unit disc
  double whole, less;
  double edge; ///< how far inwards neighbours are missed, in radii of the disc
};

/// Rows of as many numbers each, of small matrices whose size is known at run time.
inline constexpr int kSmallRow = 16;

/// The functions of the hot path, compiled for one instruction set.
struct Kernel {
  const char* instruction_set; ///< "AVX3", "AVX2", "SSE2", ..., "scalar" (reference)

  /// Sums for the centroid and the principal axes.
  void (*accumulateScatter)(const Points& points, ScatterSums& sums);

  /// Sums for the least-squares quadric over the frame (R, c).
  void (*accumulateQuadric)(const Points& points,
                            const double R[9],
                            const double c[3],
                            QuadricSums& sums);

  /// Moves every point along its ray from the viewpoint onto the quadric
  /// z = h[0] + h[1] x + h[2] y + h[3] x^2/2 + h[4] x y + h[5] y^2/2 of the frame
  /// (R, c), by two Newton steps; a point that would move by more than a tenth of its
  /// range stays.
  void (*moveOntoQuadric)(const Points& points,
                          const double R[9],
                          const double c[3],
                          const double h[6],
                          const double viewpoint[3],
                          double* const out[3]);

  /// Sums for one iteration of the fit.
  void (*accumulateNormal)(Precision precision,
                           Model model,
                           Residual residual,
                           const Points& points,
                           const State& state,
                           NormalSums& sums);

  /// Sums for the fit's exact covariance.
  void (*accumulateCovariance)(Precision precision,
                               Model model,
                               Residual residual,
                               const Points& points,
                               const State& state,
                               CovarianceSums& sums);

  /// Squared residual of every point, padding included (zero there): twice its share of
  /// the cost. Of the state only R, c and k are used. `out` holds points.padded_size
  /// numbers.
  void (*squaredResiduals)(Model model,
                           Residual residual,
                           const Points& points,
                           const State& state,
                           double* out);

  /// Where points lie about a patch.
  void (*placePoints)(const Points& points,
                      const PatchForm& patch,
                      const PlacedPoints& out);

  /// intersectRay() (patch/surface.h) from the origin of the coordinates along (x, y,
  /// 1), for `count` rays, a multiple of PointBatch::kLaneMultiple: 1/t; zero where the
  /// patch is missed. \param curvature of round surfaces, else 0.
  void (*meetRays)(const double* x,
                   const double* y,
                   int count,
                   const PatchForm& patch,
                   double curvature,
                   double* inverse_depth);

  /// Extent and moments of the pixels of points that share errors.
  void (*accumulatePixels)(const Points& points,
                           const double about[2],
                           PixelSums& sums);

  /// Of every point that shares errors, padding included.
  void (*neighborVariances)(const Points& points,
                            const NeighborVariance& neighbors,
                            double* out);

  /// sum_bb' y_b C(b - b') y_b'^T over the cells of a grid, whose covariance depends on
  /// their distance in rows and columns alone.
  /// \param out kCellRow rows of as many.
  void (*sumOverCells)(Precision precision, const CellSums& cells, double* out);

  /// J S J^T of n rows of J and a symmetric S of m, all in rows of kSmallRow, aligned,
  /// zero behind their entries.
  void (*congruence)(const double* J, int n, const double* S, int m, double* out);
};

/// The fastest one for this processor, chosen at the first call (from any thread).
const Kernel& kernel();

/// The reference code (number type double), whatever the machine offers: what tests and
/// benchmarks compare the SIMD code with.
const Kernel& referenceKernel();

/// X_i of every point (p x 3 row-major each, local frame), for stages that correlate
/// two fits; always the reference code.
void crossTerms(Model model,
                Residual residual,
                const Points& points,
                const State& state,
                std::vector<double>& X);

}} // namespace holdfast::kernel
