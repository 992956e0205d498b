/// \file Sensors, and their noise for points in the frame of their camera.
#pragma once

#include <holdfast/correlated_noise.h>
#include <holdfast/fit/point_batch.h>
#include <holdfast/sensor/sensor.h>

#include <pybind11/pybind11.h>

#include <memory>

namespace holdfast::python {

namespace py = pybind11;

/// What a sensor says of points, in double precision.
class SensorNoise {
public:
  explicit SensorNoise(const Sensor& sensor);

  /// Refills the batch with n points, m, row after row, in the frame of the camera.
  /// Those that the model has no covariance for get NaN.
  /// \param at_surface asks the model at the surface, not at the noisy points.
  void fill(const double* points, int n, bool at_surface, PointBatch& batch) const;

  /// \throw py::value_error where most points lie where the sensor cannot see, as they
  /// do in another unit, or one is behind its camera.
  void requireInView(const double* points, py::ssize_t n) const;

private:
  void evaluate(bool at_surface, PointBatch& batch) const;
  void sharePattern(bool at_surface, PointBatch& batch) const;

  Sensor sensor_;
  std::shared_ptr<const CorrelatedNoise> pattern_; ///< null: errors are independent
};

/// holdfast.Sensor
class SensorObject {
public:
  explicit SensorObject(Sensor sensor) : sensor_(std::move(sensor)), noise_(sensor_) {}

  const Sensor& sensor() const
  {
    return sensor_;
  }
  const SensorNoise& noise() const
  {
    return noise_;
  }

private:
  Sensor sensor_;
  SensorNoise noise_;
};

/// Further than this a sensor sees nothing, m: lenses that are wide and looks that are
/// long reach twice as far as its range says.
double farthestOf(const Sensor& sensor);

/// \throw py::value_error where most points are further away, as they are in another
/// unit.
void requireSameUnit(py::ssize_t too_far, py::ssize_t points, const Sensor& sensor);

/// \throw py::type_error for anything else.
const Sensor& sensorOf(py::handle object);

} // namespace holdfast::python
