#include <holdfast/sensor/sensor.h>

#include <holdfast/sensor/constant_noise_model.h>

#include <locale>
#include <memory>
#include <sstream>
#include <utility>

namespace holdfast {

Sensor
withCamera(Sensor sensor, const Camera& camera)
{
  const double ratio = static_cast<double>(camera.width) / sensor.camera.width;
  for (PatternWave& wave : sensor.pattern.waves)
    wave.length_px *= ratio;
  sensor.camera = camera;
  return sensor;
}

Sensor
withoutPattern(Sensor sensor)
{
  sensor.pattern = {};
  sensor.pattern_map.reset();
  return sensor;
}

Sensor
withConstantNoise(Sensor sensor, double sigma_m)
{
  std::ostringstream name;
  name.imbue(std::locale::classic());
  name << "constant noise of " << 1e3 * sigma_m << " mm";
  sensor.name = name.str();
  sensor = withoutPattern(std::move(sensor)); // it belongs to the camera replaced
  sensor.noise = std::make_shared<const ConstantNoiseModel>(
      ConstantNoiseModel::Parameters{sigma_m, sigma_m});
  return sensor;
}

} // namespace holdfast
