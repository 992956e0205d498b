#include "bindings.h"

#include "arrays.h"

#include <holdfast/version.h>

#include <Eigen/LU>

#include <cmath>

namespace holdfast::python {

std::string
documented(const std::string& signature, const std::string& text)
{
  return signature + "\n--\n\n" + text;
}

Pose
poseOf(py::handle object, const char* name)
{
  constexpr double kRounding = 1e-6;
  const Numbers m = numbers(object, name);
  if (m.ndim() != 2 || m.shape(0) != 4 || m.shape(1) != 4)
    failShape(name, "(4, 4)", m);
  const Eigen::Matrix<double, 4, 4, Eigen::RowMajor> T =
      Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(m.data());
  const Eigen::Matrix3d R = T.topLeftCorner<3, 3>();
  const bool is_rigid = T.allFinite() && T.row(3) == Eigen::RowVector4d(0, 0, 0, 1) &&
                        (R * R.transpose()).isIdentity(kRounding) &&
                        R.determinant() > 0.0;
  if (!is_rigid)
    throw py::value_error(std::string(name) +
                          ": it is no rigid transform [R t; 0 0 0 1]");
  return {R, T.topRightCorner<3, 1>()};
}

py::array
toArray(const Pose& pose)
{
  Eigen::Matrix4d T = Eigen::Matrix4d::Identity();
  T.topLeftCorner<3, 3>() = pose.R;
  T.topRightCorner<3, 1>() = pose.c;
  return toArray(T);
}

/// Arrays of numpy 2 are laid out as pybind11 knows them from 2.12 on; before that they
/// would be read wrongly, without a word.
void
requireKnownNumpy()
{
  constexpr int kFirstForNumpy2 = 0x020C0000;
  if (PYBIND11_VERSION_HEX >= kFirstForNumpy2)
    return;
  const std::string version =
      py::str(py::module_::import("numpy").attr("__version__")).cast<std::string>();
  if (version[0] != '1')
    throw py::import_error("holdfast was built with a pybind11 older than 2.12, which "
                           "does not know numpy " +
                           version + ": build it with a newer one, or use numpy 1");
}

} // namespace holdfast::python

PYBIND11_MODULE(_core, module)
{
  using namespace holdfast::python;
  requireKnownNumpy();
  py::options options;
  options.disable_function_signatures();
  module.doc() = "The compiled part of holdfast.";
  module.attr("__version__") = HOLDFAST_VERSION;
  bindSensor(module);
  bindPatches(module);
  bindFit(module);
  bindExtract(module);
  bindSimulation(module);
  bindCalibration(module);
  bindPatchMap(module);
  bindFoot(module);
  bindContact(module);
  bindRiskGrid(module);
}
