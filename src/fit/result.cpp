#include <holdfast/fit/result.h>

namespace holdfast {

std::string_view
statusName(FitStatus status)
{
  switch (status) {
  case FitStatus::Converged:
    return "converged";
  case FitStatus::AxisNotObservable:
    return "axis_not_observable";
  case FitStatus::CurvatureNotObservable:
    return "curvature_not_observable";
  case FitStatus::IterationLimit:
    return "iteration_limit";
  case FitStatus::TooFewPoints:
    return "too_few_points";
  case FitStatus::Degenerate:
    return "degenerate";
  case FitStatus::CurvatureOutOfRange:
    return "curvature_out_of_range";
  case FitStatus::CurvatureSignMismatch:
    return "curvature_sign_mismatch";
  case FitStatus::OrientationSingular:
    return "orientation_singular";
  case FitStatus::NonFinite:
    return "non_finite";
  }
  return "unknown";
}

bool
isUsable(FitStatus status)
{
  return status == FitStatus::Converged || status == FitStatus::AxisNotObservable ||
         status == FitStatus::CurvatureNotObservable;
}

} // namespace holdfast
