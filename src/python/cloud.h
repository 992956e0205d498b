/// \file Clouds from arrays.
#pragma once

#include <holdfast/pcl/range_cloud.h>

#include <pybind11/pybind11.h>

#include <string>

namespace holdfast::python {

namespace py = pybind11;

/// Points (N, 3), or an image (H, W, 3), with their covariances, if any, (..., 3, 3) or
/// (..., 6). Single precision, as PCL's: coordinates too large for that are shifted
/// (RangeCloud::offset), and so is the sensor's pose.
/// \param sensor_pose (4, 4) in the frame of the points; None: it is that of the
/// sensor. \throw py::type_error or py::value_error for what is none of these, or holds
/// no finite point.
RangeCloud cloudOf(py::handle points, py::handle covariances, py::handle sensor_pose);

} // namespace holdfast::python
