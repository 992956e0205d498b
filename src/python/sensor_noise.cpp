#include "sensor_object.h"

#include "arrays.h"
#include "keywords.h"

#include <holdfast/fit/reference_points.h>

#include <array>
#include <cmath>
#include <limits>
#include <string>

namespace holdfast::python {
namespace {

constexpr double kNoCovariance = std::numeric_limits<double>::quiet_NaN();

using Channels = std::array<PointBatch::Channel, 3>;
constexpr Channels kMeasured{PointBatch::X, PointBatch::Y, PointBatch::Z};
constexpr Channels kReference{PointBatch::RX, PointBatch::RY, PointBatch::RZ};

} // namespace

SensorNoise::SensorNoise(const Sensor& sensor) : sensor_(sensor)
{
  if (!sensor.pattern.empty())
    pattern_ = std::make_shared<const CorrelatedNoise>(sensor.pattern);
}

void
SensorNoise::fill(const double* points, int n, bool at_surface, PointBatch& batch) const
{
  // In the frame of the camera first, where the model is asked.
  batch.clear(Eigen::Vector3d(points[0], points[1], points[2]));
  batch.resize(n);
  double* xyz[3];
  for (std::size_t k = 0; k < 3; ++k)
    xyz[k] = batch.channel(kMeasured[k]);
  for (int i = 0; i < n; ++i)
    for (int k = 0; k < 3; ++k)
      xyz[k][i] = points[3 * i + k];
  evaluate(at_surface, batch);
  if (pattern_)
    sharePattern(at_surface, batch);
  for (int i = 0; i < n; ++i)
    for (int k = 0; k < 3; ++k)
      xyz[k][i] = points[3 * i + k] - points[k];
}

void
SensorNoise::evaluate(bool at_surface, PointBatch& batch) const
{
  if (at_surface)
    computeReferencePoints(batch, Eigen::Vector3d::Zero());
  const Channels& at = at_surface ? kReference : kMeasured;
  const double* z = batch.channel(at[2]);
  const CovarianceChannels s{batch.channel(PointBatch::SXX),
                             batch.channel(PointBatch::SXY),
                             batch.channel(PointBatch::SXZ),
                             batch.channel(PointBatch::SYY),
                             batch.channel(PointBatch::SYZ),
                             batch.channel(PointBatch::SZZ)};
  sensor_.noise->covariances(batch.size(),
                             batch.channel(at[0]),
                             batch.channel(at[1]),
                             z,
                             s);
  if (sensor_.noise->isOmnidirectional())
    return;
  for (int i = 0; i < batch.size(); ++i)
    s.xx[i] = z[i] > 0.0 ? s.xx[i] : kNoCovariance;
}

void
SensorNoise::sharePattern(bool at_surface, PointBatch& batch) const
{
  const double* x = batch.channel(PointBatch::X);
  const double* y = batch.channel(PointBatch::Y);
  const double* z = batch.channel(PointBatch::Z);
  const Camera& camera = sensor_.camera;
  double* u = batch.channel(PointBatch::U);
  double* v = batch.channel(PointBatch::V);
  for (int i = 0; i < batch.size(); ++i) {
    const double inverse = 1.0 / z[i];
    u[i] = camera.fx * x[i] * inverse + camera.cx;
    v[i] = camera.fy * y[i] * inverse + camera.cy;
  }
  const Channels& at = at_surface ? kReference : kMeasured;
  const double* const point[3] = {batch.channel(at[0]),
                                  batch.channel(at[1]),
                                  batch.channel(at[2])};
  double* const direction[3] = {batch.channel(PointBatch::EX),
                                batch.channel(PointBatch::EY),
                                batch.channel(PointBatch::EZ)};
  sensor_.noise->patternDirections(batch.size(), point, direction);
  batch.setPattern(pattern_);
}

void
SensorNoise::requireInView(const double* points, py::ssize_t n) const
{
  const bool is_camera = !sensor_.noise->isOmnidirectional();
  const double limit = farthestOf(sensor_);
  py::ssize_t too_far = 0, behind = -1;
  for (py::ssize_t i = 0; i < n; ++i) {
    const double* q = points + 3 * i;
    const double squared = q[0] * q[0] + q[1] * q[1] + q[2] * q[2];
    too_far += squared > limit * limit ? 1 : 0;
    if (is_camera && q[2] <= 0.0)
      behind = i;
  }
  requireSameUnit(too_far, n, sensor_);
  if (behind >= 0)
    throw py::value_error("points: row " + std::to_string(behind) +
                          " is not in front of the camera (z > 0), where " +
                          sensor_.name + " sees nothing");
}

double
farthestOf(const Sensor& sensor)
{
  return 2.0 * sensor.max_range_m;
}

void
requireSameUnit(py::ssize_t too_far, py::ssize_t points, const Sensor& sensor)
{
  if (2 * too_far > points)
    throw py::value_error("points: " + std::to_string(too_far) + " of " +
                          std::to_string(points) + " are more than " +
                          show(farthestOf(sensor)) + " m away, twice as far as " +
                          sensor.name + " sees; points are in m, not in mm");
}

const Sensor&
sensorOf(py::handle object)
{
  if (!py::isinstance<SensorObject>(object))
    throw py::type_error("sensor: a holdfast.Sensor is needed, not " +
                         kindText(object));
  return object.cast<const SensorObject&>().sensor();
}

} // namespace holdfast::python
