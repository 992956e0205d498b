#include "keywords.h"

#include "arrays.h"

#include <cmath>
#include <limits>
#include <sstream>

namespace holdfast::python {
namespace {

[[noreturn]] void
failKind(const std::string& name, const char* wanted, py::handle got)
{
  throw py::type_error(name + ": " + wanted + " is needed, not " + kindText(got));
}

/// numpy's own bool is no Python bool; its name is another one from numpy 2 on.
bool
isFlag(py::handle value)
{
  return PyBool_Check(value.ptr()) != 0 ||
         py::isinstance(value, py::module_::import("numpy").attr("bool_"));
}

} // namespace

void
read(const std::string& name, py::handle value, double& out)
{
  const bool is_text =
      py::isinstance<py::str>(value) || py::isinstance<py::bytes>(value);
  if (!is_text && PyBool_Check(value.ptr()) == 0)
    out = PyFloat_AsDouble(value.ptr());
  else
    failKind(name, "a number", value);
  if (PyErr_Occurred() != nullptr) {
    PyErr_Clear();
    failKind(name, "a number", value);
  }
  if (std::isnan(out))
    throw py::value_error(name + ": it is not a number");
}

void
read(const std::string& name, py::handle value, int& out)
{
  if (PyBool_Check(value.ptr()) != 0 || PyIndex_Check(value.ptr()) == 0)
    failKind(name, "a whole number", value);
  const auto whole = py::reinterpret_steal<py::int_>(PyNumber_Index(value.ptr()));
  const long long number = PyLong_AsLongLong(whole.ptr());
  const bool failed = PyErr_Occurred() != nullptr;
  PyErr_Clear();
  if (failed || number < std::numeric_limits<int>::min() ||
      number > std::numeric_limits<int>::max())
    throw py::value_error(name + ": it is too large");
  out = static_cast<int>(number);
}

void
read(const std::string& name, py::handle value, std::uint64_t& out)
{
  if (PyBool_Check(value.ptr()) != 0 || PyIndex_Check(value.ptr()) == 0)
    failKind(name, "a whole number", value);
  const auto whole = py::reinterpret_steal<py::int_>(PyNumber_Index(value.ptr()));
  out = PyLong_AsUnsignedLongLong(whole.ptr());
  if (PyErr_Occurred() != nullptr) {
    PyErr_Clear();
    throw py::value_error(name + ": it must lie between 0 and 2**64 - 1");
  }
}

void
read(const std::string& name, py::handle value, bool& out)
{
  if (!isFlag(value))
    failKind(name, "True or False", value);
  out = PyObject_IsTrue(value.ptr()) == 1;
}

std::string
readText(const std::string& name, py::handle value)
{
  if (!py::isinstance<py::str>(value))
    failKind(name, "a text", value);
  return value.cast<std::string>();
}

std::string
show(double value)
{
  return py::repr(py::float_(value)).cast<std::string>();
}

std::string
show(int value)
{
  return std::to_string(value);
}

std::string
show(std::uint64_t value)
{
  return std::to_string(value);
}

std::string
show(bool value)
{
  return value ? "True" : "False";
}

std::string
wrapped(const std::string& words)
{
  constexpr std::size_t kWidth = 86;
  std::istringstream in(words);
  std::string text, line = "   ", word;
  while (in >> word) {
    if (line.size() + 1 + word.size() > kWidth) {
      text += line + "\n";
      line = "       ";
    }
    line += " " + word;
  }
  return text + line + "\n";
}

void
failWord(const std::string& name,
         const std::string& word,
         const std::vector<std::string>& known)
{
  std::string list;
  for (const std::string& each : known)
    list += (list.empty() ? "" : ", ") + each;
  throw py::value_error(name + ": '" + word + "' is none of " + list);
}

} // namespace holdfast::python
