/// \file What comes from numpy, and what goes back.
#pragma once

#include <Eigen/Core>

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <initializer_list>
#include <string>
#include <utility>
#include <vector>

namespace holdfast::python {

namespace py = pybind11;

/// float64 in C order.
using Numbers = py::array_t<double, py::array::c_style>;

/// The caller's own memory where it is float64 in C order, else a copy: float32, whole
/// numbers, Fortran order, strides, lists.
/// \param name for messages.
/// \throw py::type_error for what holds no real numbers.
Numbers numbers(py::handle object, const char* name);

/// "(100, 3)".
std::string shapeText(const py::array& array);

/// \throw py::value_error "NAME: shape WANTED is needed, not (...)".
[[noreturn]] void failShape(const char* name, const char* wanted, const py::array& got);

/// "a list", "an array of objects": for messages.
std::string kindText(py::handle object);

/// Points (N, 3), one at least.
Numbers pointRows(py::handle object, const char* name);

/// N covariances, m^2.
class CovarianceRows {
public:
  /// \param object (N, 3, 3), (N, 6) with xx xy xz yy yz zz, or (3, 3): one for all.
  /// \throw py::value_error unless it has one of these shapes, or where a matrix is not
  /// symmetric.
  CovarianceRows(py::handle object, py::ssize_t points, const char* name);

  /// Upper triangle of number i.
  void get(py::ssize_t i, double (&s)[6]) const
  {
    const double* at = data_ + i * stride_;
    for (int k = 0; k < 6; ++k)
      s[k] = at[slots_[k]];
  }

private:
  void requireSymmetric(const char* name, py::ssize_t matrices) const;

  Numbers array_;
  const double* data_;
  py::ssize_t stride_;
  const int* slots_; ///< of the upper triangle
};

/// Says which row of points or covariances is no measurement, and why.
/// \throw py::value_error where there is one.
void requireMeasurements(const double* points,
                         py::ssize_t n,
                         const CovarianceRows* covariances,
                         const char* points_name = "points",
                         const char* covariances_name = "covariances");

/// A vector of three finite numbers.
Eigen::Vector3d vectorOf(py::handle object, const char* name);

/// A new array of any shape.
template <typename T>
py::array_t<T>
newArray(std::initializer_list<py::ssize_t> shape)
{
  return py::array_t<T>(std::vector<py::ssize_t>(shape));
}

/// A vector or matrix as an array of its own.
template <typename Derived>
py::array_t<double>
toArray(const Eigen::MatrixBase<Derived>& matrix)
{
  const bool is_vector = Derived::ColsAtCompileTime == 1;
  py::array_t<double> out(is_vector ?
                              std::vector<py::ssize_t>{matrix.rows()} :
                              std::vector<py::ssize_t>{matrix.rows(), matrix.cols()});
  double* to = out.mutable_data();
  for (Eigen::Index i = 0; i < matrix.rows(); ++i)
    for (Eigen::Index j = 0; j < matrix.cols(); ++j)
      *to++ = matrix(i, j);
  return out;
}

/// The memory of a vector as an array, which keeps it.
template <typename T>
py::array
keptArray(std::vector<T> values, std::vector<py::ssize_t> shape)
{
  auto* kept = new std::vector<T>(std::move(values));
  const py::capsule owner(kept,
                          [](void* p) { delete static_cast<std::vector<T>*>(p); });
  return py::array_t<T>(std::move(shape), kept->data(), owner);
}

} // namespace holdfast::python
