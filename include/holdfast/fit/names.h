/// \file Names of what is asked of a fit and of how it ended.
#pragma once

#include <holdfast/fit/options.h>
#include <holdfast/fit/result.h>
#include <holdfast/patch/names.h>

#include <array>
#include <cstddef>
#include <string_view>

namespace holdfast {

/// Those of the two requests that leave the type to the data, then the surfaces'.
constexpr auto
surfaceRequestNames()
{
  constexpr std::size_t kOpen = kOpenRequests;
  std::array<std::string_view, kOpen + kSurfaceNames.words.size()> words{"auto",
                                                                         "paraboloid"};
  for (std::size_t i = 0; i < kSurfaceNames.words.size(); ++i)
    words[kOpen + i] = kSurfaceNames.words[i];
  return EnumNames<SurfaceRequest, words.size()>{words};
}

inline constexpr auto kSurfaceRequestNames = surfaceRequestNames();

inline constexpr EnumNames<Residual, 2> kResidualNames{{"sampson", "ray"}};

inline constexpr EnumNames<FitStatus, 10> kStatusNames{{"converged",
                                                        "axis_not_observable",
                                                        "curvature_not_observable",
                                                        "iteration_limit",
                                                        "too_few_points",
                                                        "degenerate",
                                                        "curvature_out_of_range",
                                                        "curvature_sign_mismatch",
                                                        "orientation_singular",
                                                        "non_finite"}};

struct FitFlagName {
  std::string_view name;
  bool FitFlags::*flag;
};

inline constexpr std::array<FitFlagName, 3> kFitFlagNames{
    {{"axis_not_observable", &FitFlags::axis_not_observable},
     {"curvature_not_observable", &FitFlags::curvature_not_observable},
     {"orientation_singular", &FitFlags::orientation_singular}}};

} // namespace holdfast
