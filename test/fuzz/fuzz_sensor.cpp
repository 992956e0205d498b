/// \file Sensor files of any bytes.
#include "fuzz.h"
#include <holdfast/io/config.h>

#include <cmath>

int
LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
  using namespace holdfast;
  using fuzz::require;
  static const fuzz::MemoryFile file;
  try {
    const Sensor sensor = loadSensor(file.hold(data, size));
    const Camera& camera = sensor.camera;
    require(!sensor.name.empty(), "a sensor has a name");
    require(sensor.noise != nullptr, "a sensor has a noise model");
    require(camera.width > 0 && camera.height > 0, "a camera has pixels");
    require(camera.fx > 0.0 && camera.fy > 0.0, "a camera has focal lengths");
    require(std::isfinite(camera.cx) && std::isfinite(camera.cy),
            "the principal point is finite");
    require(sensor.min_range_m >= 0.0 && sensor.max_range_m > sensor.min_range_m,
            "a sensor has a range");
  }
  catch (const std::runtime_error& error) {
    fuzz::requireOneLine(error);
  }
  return 0;
}
