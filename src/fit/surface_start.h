// Closed-form starts of the surface fits.
#pragma once

#include <holdfast/fit/surface_fit.h>

namespace holdfast {

// A start about one sigma from the solution: the least-squares quadric over the
// principal frame. Where the points wrap around a sphere or cylinder too far for a
// height field, algebraic fits compete with it and the lowest cost wins.
UnboundedSurface surfaceStart(kernel::Model model,
                              Residual residual,
                              const kernel::Points& points,
                              const Scatter& scatter);

} // namespace holdfast
