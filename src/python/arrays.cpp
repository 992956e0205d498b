#include "arrays.h"

#include <holdfast/geometry/gaussian.h>

#include <cmath>

namespace holdfast::python {
namespace {

constexpr int kMatrixSlots[6] = {0, 1, 2, 4, 5, 8};
constexpr int kPackedSlots[6] = {0, 1, 2, 3, 4, 5};

std::string
rowText(const char* name, py::ssize_t row, const std::string& problem)
{
  return std::string(name) + ": row " + std::to_string(row) + " " + problem;
}

bool
isFinite(const double* values, int n)
{
  for (int i = 0; i < n; ++i)
    if (!std::isfinite(values[i]))
      return false;
  return true;
}

Eigen::Matrix3d
symmetric(const double (&s)[6])
{
  Eigen::Matrix3d S;
  S << s[0], s[1], s[2], s[1], s[3], s[4], s[2], s[4], s[5];
  return S;
}

/// Empty for a covariance.
std::string
problemOf(const double (&s)[6])
{
  if (!isFinite(s, 6))
    return "is not finite";
  if (s[0] < 0.0 || s[3] < 0.0 || s[5] < 0.0)
    return "has a negative variance";
  if (!isPositiveSemiDefinite(symmetric(s)))
    return "is no covariance: it has a negative eigenvalue";
  return {};
}

/// What Numbers::ensure() would find out more slowly.
bool
isReadInPlace(py::handle object)
{
  using Api = py::detail::npy_api;
  constexpr int kPlain = Api::NPY_ARRAY_C_CONTIGUOUS_ | Api::NPY_ARRAY_ALIGNED_;
  if (!py::isinstance<py::array>(object))
    return false;
  const auto array = py::reinterpret_borrow<py::array>(object);
  const py::dtype type = array.dtype();
  return (array.flags() & kPlain) == kPlain && type.num() == Api::NPY_DOUBLE_ &&
         type.byteorder() == '=';
}

} // namespace

std::string
kindText(py::handle object)
{
  if (py::isinstance<py::array>(object))
    return "an array of " + py::str(py::reinterpret_borrow<py::array>(object).dtype())
                                .cast<std::string>();
  return py::str(py::type::of(object).attr("__name__")).cast<std::string>();
}

Numbers
numbers(py::handle object, const char* name)
{
  if (isReadInPlace(object))
    return py::reinterpret_borrow<Numbers>(object);
  const auto array = py::isinstance<py::array>(object) ?
                         py::reinterpret_borrow<py::array>(object) :
                         py::array::ensure(object);
  // Complex numbers would lose a part, texts be read, and objects be anything.
  const char kind = array ? array.dtype().kind() : 'O';
  if (kind != 'f' && kind != 'i' && kind != 'u') {
    PyErr_Clear();
    throw py::type_error(std::string(name) +
                         ": an array of real numbers is needed, not " +
                         (array ? kindText(array) : kindText(object)));
  }
  auto result = Numbers::ensure(array);
  if (!result)
    throw py::error_already_set();
  return result;
}

std::string
shapeText(const py::array& array)
{
  std::string text = "(";
  for (py::ssize_t i = 0; i < array.ndim(); ++i)
    text += (i > 0 ? ", " : "") + std::to_string(array.shape(i));
  return text + (array.ndim() == 1 ? ",)" : ")");
}

void
failShape(const char* name, const char* wanted, const py::array& got)
{
  throw py::value_error(std::string(name) + ": shape " + wanted + " is needed, not " +
                        shapeText(got));
}

Numbers
pointRows(py::handle object, const char* name)
{
  Numbers rows = numbers(object, name);
  if (rows.ndim() != 2 || rows.shape(1) != 3)
    failShape(name, "(N, 3)", rows);
  if (rows.shape(0) == 0)
    throw py::value_error(std::string(name) + ": there are none");
  return rows;
}

CovarianceRows::CovarianceRows(py::handle object, py::ssize_t points, const char* name)
: array_(numbers(object, name)), data_(array_.data()), stride_(9), slots_(kMatrixSlots)
{
  const auto is = [&](std::initializer_list<py::ssize_t> shape) {
    return array_.ndim() == static_cast<py::ssize_t>(shape.size()) &&
           std::equal(shape.begin(), shape.end(), array_.shape());
  };
  if (is({points, 6})) {
    stride_ = 6;
    slots_ = kPackedSlots;
  }
  else if (is({points, 3, 3})) {
    requireSymmetric(name, points);
  }
  else if (is({3, 3})) {
    stride_ = 0;
    requireSymmetric(name, 1);
  }
  else {
    const std::string n = std::to_string(points);
    failShape(
        name,
        ("(" + n + ", 3, 3), (" + n + ", 6) or (3, 3) beside " + n + " points").c_str(),
        array_);
  }
}

void
CovarianceRows::requireSymmetric(const char* name, py::ssize_t matrices) const
{
  // Products like R S R^T leave rounding errors.
  constexpr double kRounding = 1e-6;
  for (py::ssize_t i = 0; i < matrices; ++i) {
    const double* s = data_ + 9 * i;
    const double off =
        std::abs(s[1] - s[3]) + std::abs(s[2] - s[6]) + std::abs(s[5] - s[7]);
    if (off > kRounding * (s[0] + s[4] + s[8]) && off > 0.0 &&
        s[0] + s[4] + s[8] >= 0.0)
      throw py::value_error(rowText(name, i, "is no covariance: it is not symmetric"));
  }
}

void
requireMeasurements(const double* points,
                    py::ssize_t n,
                    const CovarianceRows* covariances,
                    const char* points_name,
                    const char* covariances_name)
{
  for (py::ssize_t i = 0; i < n; ++i) {
    if (!isFinite(points + 3 * i, 3))
      throw py::value_error(
          rowText(points_name, i, "is not finite; leave out what was not measured"));
    if (covariances == nullptr)
      continue;
    double s[6];
    covariances->get(i, s);
    if (const std::string problem = problemOf(s); !problem.empty())
      throw py::value_error(rowText(covariances_name, i, problem));
  }
}

Eigen::Vector3d
vectorOf(py::handle object, const char* name)
{
  const Numbers array = numbers(object, name);
  if (array.ndim() != 1 || array.shape(0) != 3)
    failShape(name, "(3,)", array);
  if (!isFinite(array.data(), 3))
    throw py::value_error(std::string(name) + ": it is not finite");
  return {array.at(0), array.at(1), array.at(2)};
}

} // namespace holdfast::python
