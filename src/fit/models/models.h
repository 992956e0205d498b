// The one place that knows all models.
#pragma once

#include "cylinder.h"
#include "paraboloid.h"
#include "plane.h"
#include "sphere.h"

#include <holdfast/patch/types.h>

#include <array>
#include <cstddef>

namespace holdfast {

// Calls f with the model's struct, an empty object.
template <typename F>
decltype(auto)
withModel(kernel::Model model, F&& f)
{
  using kernel::Model;
  switch (model) {
  case Model::Paraboloid:
    return f(models::Paraboloid{});
  case Model::Sphere:
    return f(models::Sphere{});
  case Model::Cylinder:
    return f(models::Cylinder{});
  case Model::Plane:
    break;
  }
  return f(models::Plane{});
}

// Whether the surface closes around its centre or axis.
inline bool
wraps(kernel::Model model)
{
  return withModel(model, [](auto m) { return m.kWraps; });
}

// The model that is fitted for a type.
constexpr kernel::Model
modelOf(SurfaceType surface)
{
  using kernel::Model;
  // In the order of SurfaceType.
  constexpr std::array models{Model::Plane,
                              Model::Sphere,
                              Model::Cylinder,
                              Model::Paraboloid,
                              Model::Paraboloid,
                              Model::Paraboloid,
                              Model::Paraboloid};
  static_assert(models.size() == kSurfaceTraits.size(), "every surface has a model");
  return models.at(static_cast<std::size_t>(surface));
}

} // namespace holdfast
