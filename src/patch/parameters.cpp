#include <holdfast/geometry/gaussian.h>
#include <holdfast/geometry/rotation.h>
#include <holdfast/patch/parameters.h>

#include <stdexcept>

namespace holdfast {
namespace {

void
appendBoundaryNames(BoundaryType boundary, std::vector<std::string>& names)
{
  switch (boundary) {
  case BoundaryType::Ellipse:
  case BoundaryType::Rectangle:
    names.insert(names.end(), {"d_x", "d_y"});
    break;
  case BoundaryType::Circle:
    names.emplace_back("d");
    break;
  case BoundaryType::Quad:
    names.insert(names.end(), {"d_1", "d_2", "d_3", "d_4", "gamma"});
    break;
  }
}

void
appendCurvatureNames(SurfaceType surface, std::vector<std::string>& names)
{
  const int count = curvatureParameterCount(surface);
  if (count == 1)
    names.emplace_back("kappa");
  if (count == 2)
    names.insert(names.end(), {"kappa_x", "kappa_y"});
}

} // namespace

ParameterLayout
layoutOf(PatchType type)
{
  if (!isLegal(type))
    throw std::invalid_argument("holdfast: illegal pair of surface and boundary");
  return {boundaryParameterCount(type.boundary),
          curvatureParameterCount(type.surface),
          rotationParameterCount(type)};
}

std::vector<std::string>
parameterNames(PatchType type)
{
  const ParameterLayout layout = layoutOf(type);
  std::vector<std::string> names;
  appendBoundaryNames(type.boundary, names);
  appendCurvatureNames(type.surface, names);
  names.insert(names.end(), {"r_x", "r_y"});
  if (layout.r_count == 3)
    names.emplace_back("r_z");
  names.insert(names.end(), {"c_x", "c_y", "c_z"});
  return names;
}

ParameterVector
pack(const Patch& patch)
{
  const ParameterLayout layout = layoutOf(patch.type);
  ParameterVector parameters(layout.size());
  parameters.head(layout.d_count) = patch.d.head(layout.d_count);
  parameters.segment(layout.k(), layout.k_count) = patch.kappa.head(layout.k_count);
  parameters.segment(layout.r(), layout.r_count) = patch.r.head(layout.r_count);
  parameters.tail<3>() = patch.c;
  return parameters;
}

Patch
unpack(PatchType type, const ParameterVector& parameters)
{
  const ParameterLayout layout = layoutOf(type);
  if (parameters.size() != layout.size())
    throw std::invalid_argument("holdfast::unpack: " + std::to_string(layout.size()) +
                                " parameters expected, " +
                                std::to_string(parameters.size()) + " given");
  Patch patch;
  patch.type = type;
  patch.d.head(layout.d_count) = parameters.head(layout.d_count);
  patch.kappa.head(layout.k_count) = parameters.segment(layout.k(), layout.k_count);
  patch.r.head(layout.r_count) = parameters.segment(layout.r(), layout.r_count);
  patch.c = parameters.tail<3>();
  return patch;
}

ParameterMatrix
tangentJacobian(const Patch& patch)
{
  const ParameterLayout layout = layoutOf(patch.type);
  ParameterMatrix J = ParameterMatrix::Identity(layout.size(), layout.size());
  J.block(layout.r(), layout.r(), layout.r_count, layout.r_count) =
      rightJacobian(patch.r).topLeftCorner(layout.r_count, layout.r_count);
  return J;
}

ParameterMatrix
toTangent(const Patch& patch, const ParameterMatrix& covariance)
{
  const ParameterMatrix J = tangentJacobian(patch);
  if (covariance.rows() != J.rows() || covariance.cols() != J.cols())
    throw std::invalid_argument(
        "holdfast::toTangent: the covariance must be " + std::to_string(J.rows()) +
        " x " + std::to_string(J.rows()) + ", not " +
        std::to_string(covariance.rows()) + " x " + std::to_string(covariance.cols()));
  return propagate(J, covariance);
}

} // namespace holdfast
