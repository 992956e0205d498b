/// \file The parts of the module.
#pragma once

#include <holdfast/geometry/pose.h>

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <string>

namespace holdfast::python {

namespace py = pybind11;

void bindSensor(py::module_& module);
void bindPatch(py::module_& module);
void bindPatches(py::module_& module);
void bindFit(py::module_& module);
void bindExtract(py::module_& module);
void bindSimulation(py::module_& module);
void bindCalibration(py::module_& module);
void bindPatchMap(py::module_& module);
void bindFoot(py::module_& module);
void bindContact(py::module_& module);
void bindRiskGrid(py::module_& module);

/// A rigid transform as a (4, 4) matrix.
/// \throw py::value_error for what is none.
Pose poseOf(py::handle object, const char* name);
py::array toArray(const Pose& pose);

/// Docstrings may lead with a signature that Python reads: "name(...)\n--\n\n".
std::string documented(const std::string& signature, const std::string& text);

} // namespace holdfast::python
