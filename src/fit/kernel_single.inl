// The fit's sums in single precision but for what cancels: coordinates, f, cost and L.
// Included like kernel_point.inl, in a namespace within that of doubles, `wide`.

#include "kernel_single_number.inl"

#include "kernel_surface.inl"

template <typename Surface>
using WideSurface = typename wide::SurfaceOf<Surface::kModel>::Type;

template <typename Surface>
HOLDFAST_INLINE void
placeInFrame(const Surface& surface,
             const Points& points,
             int i,
             Number q[3],
             Number& f)
{
  const WideSurface<Surface> wide_surface{surface.s};
  wide::Number near[3], far[3], f_near, f_far;
  wide::placeInFrame(wide_surface, points, i, near, f_near);
  wide::placeInFrame(wide_surface, points, i + wide::kLanes, far, f_far);
  HOLDFAST_UNROLLED_FOR (int k = 0; k < 3; ++k)
    q[k] = joined(near[k], far[k]);
  f = joined(f_near, f_far);
}

#include "kernel_evaluation.inl"

HOLDFAST_INLINE void
findCells(const PatternPoints& pattern, int i, double* rows)
{
  wide::findCells(pattern, i, rows);
  wide::findCells(pattern, i + wide::kLanes, rows + wide::kLanes);
}

#include "kernel_cells.inl"

#include "kernel_cross.inl"

#include "kernel_foot_point.inl"

template <typename Surface>
class FootSearch {
public:
  HOLDFAST_INLINE explicit FootSearch(const Surface& surface)
  : surface_(surface), wide_surface_{surface.s}, search_(wide_surface_)
  {}

  HOLDFAST_INLINE void find(const Points& points, int i, Foot& foot)
  {
    wide::Local<wide::BatchNoise> local;
    wide::Foot near, far;
    const wide::Number near_ratio = search_.locate(points, i, local, near);
    const wide::Number far_ratio = search_.locate(points, i + wide::kLanes, local, far);
    HOLDFAST_UNROLLED_FOR (int k = 0; k < 3; ++k) {
      foot.q[k] = joined(near.q[k], far.q[k]);
      foot.t[k] = joined(near.t[k], far.t[k]);
      foot.r[k] = joined(near.r[k], far.r[k]);
    }
    foot.s = joined(near.s, far.s);
    foot.inverse_D = joined(near.inverse_D, far.inverse_D);
    foot.omega = joined(near.omega, far.omega);
    foot.complete(surface_, joined(near_ratio, far_ratio));
    Number S[6];
    loadCovariance(points, i, S);
    rotateCovarianceIntoFrame(surface_.s.R, S, foot.S);
  }

  HOLDFAST_INLINE bool allMeet() const
  {
    return search_.allMeet() && search_.allAcross();
  }

  void reduce(CovarianceSums& out) const
  {
    search_.reduce(out);
  }

private:
  const Surface& surface_;
  WideSurface<Surface> wide_surface_;
  wide::FootSearch<WideSurface<Surface>> search_;
};

#include "kernel_foot.inl"

#include "kernel_choice.inl"
