/// \file Feet as Python has them.
#pragma once

#include <holdfast/contact/foot.h>

#include <pybind11/pybind11.h>

namespace holdfast::python {

namespace py = pybind11;

/// holdfast.Foot
struct FootObject {
  Foot foot;
};

/// \throw py::type_error for anything else.
const Foot& footOf(py::handle object);

} // namespace holdfast::python
