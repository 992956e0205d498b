// Which sums are asked for, for any number type. Included after kernel_foot.inl.

// Calls action.run<Surface, ResidualPolicy>() for the surface and residual named.
template <typename ResidualPolicy, typename Action>
auto
forSurface(Model model, const Action& action)
{
  switch (model) {
  case Model::Paraboloid:
    return action.template run<ParaboloidSurface, ResidualPolicy>();
  case Model::Sphere:
    return action.template run<SphereSurface, ResidualPolicy>();
  case Model::Cylinder:
    return action.template run<CylinderSurface, ResidualPolicy>();
  case Model::Plane:
    break;
  }
  // A plane has no curvature: the two residuals are one.
  return action.template run<PlaneSurface, SampsonResidual>();
}

template <typename Action>
auto
forSurfaceAndResidual(Model model, Residual residual, const Action& action)
{
  return residual == Residual::Ray ? forSurface<RayResidual>(model, action) :
                                     forSurface<SampsonResidual>(model, action);
}

struct NormalAction {
  const Points& points;
  const State& state;
  NormalSums& sums;

  template <typename Surface, typename ResidualPolicy>
  void run() const
  {
    normalSums<Surface, ResidualPolicy>(points, state, sums);
  }
};

// By the feet of the rays; false where there are none.
struct FootAction {
  const Points& points;
  const State& state;
  CovarianceSums& sums;

  template <typename Surface, typename ResidualPolicy>
  bool run() const
  {
    // A plane has no curvature: whatever its residual, it is that of the ray.
    constexpr bool kHasFeet =
        ResidualPolicy::kUsesCurvature || Surface::kModel == Model::Plane;
    return kHasFeet && footSums<Surface>(points, state, sums);
  }
};

inline void
accumulateNormal(Model model,
                 Residual residual,
                 const Points& points,
                 const State& state,
                 NormalSums& sums)
{
  forSurfaceAndResidual(model, residual, NormalAction{points, state, sums});
}

inline bool
accumulateByFeet(Model model,
                 Residual residual,
                 const Points& points,
                 const State& state,
                 CovarianceSums& sums)
{
  return forSurfaceAndResidual(model, residual, FootAction{points, state, sums});
}
