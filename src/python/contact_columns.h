/// \file What is known of contacts, by name, alike for one and for many.
#pragma once

#include <holdfast/contact/foothold.h>

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <functional>
#include <string>
#include <vector>

namespace holdfast::python {

namespace py = pybind11;

/// Something that each contact has.
struct ContactColumn {
  const char* name;
  /// A row for each.
  std::function<py::array(const std::vector<Foothold>&)> all;
  /// None where it is not known.
  std::function<py::object(const Foothold&)> one;
  const char* help; ///< begins with the shape of a row
};

const std::vector<ContactColumn>& contactColumns();

/// kRiskAssumptions
py::tuple riskAssumptions();

/// The same as a section of help.
std::string riskAssumptionsHelp();

} // namespace holdfast::python
