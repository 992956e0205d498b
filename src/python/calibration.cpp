// How large the noise of a camera is, from frames of a still scene.
#include "bindings.h"

#include "arrays.h"
#include "keywords.h"
#include "sensor_object.h"

#include <holdfast/sensor/noise_calibration.h>

#include <cmath>

namespace holdfast::python {
namespace {

PointImage
imageOf(py::handle object)
{
  const Numbers array = numbers(object, "frames");
  if (array.ndim() != 3 || array.shape(2) != 3)
    failShape("frames", "(H, W, 3) of each", array);
  PointImage image;
  image.height = static_cast<int>(array.shape(0));
  image.width = static_cast<int>(array.shape(1));
  image.points.resize(static_cast<std::size_t>(array.size() / 3));
  for (std::size_t i = 0; i < image.points.size(); ++i)
    image.points[i] =
        Eigen::Map<const Eigen::Vector3d>(array.data() + 3 * i).cast<float>();
  return image;
}

/// (value, low, high), or None.
py::object
tupleOf(const Estimate& estimate)
{
  if (!estimate.isKnown())
    return py::none();
  return py::make_tuple(estimate.value, estimate.low, estimate.high);
}

py::dict
dictOf(const DisparitySigmas& sigmas)
{
  py::dict out;
  out["single"] = tupleOf(sigmas.single);
  out["temporal"] = tupleOf(sigmas.temporal);
  out["fixed"] = tupleOf(sigmas.fixed);
  return out;
}

const char*
wordOf(NoiseCalibrationStatus status)
{
  switch (status) {
  case NoiseCalibrationStatus::Ok:
    return "ok";
  case NoiseCalibrationStatus::NothingStatic:
    return "nothing_static";
  case NoiseCalibrationStatus::NothingFlat:
    return "nothing_flat";
  }
  return "";
}

py::dict
dictOf(const NoiseCalibration& c)
{
  py::dict out;
  out["status"] = wordOf(c.status);
  out["frames"] = c.frames;
  out["pixels"] = c.pixels;
  out["planes"] = c.planes;
  out["region_px"] = c.region_px;
  const bool is_ok = c.status == NoiseCalibrationStatus::Ok;
  out["depth_m"] = is_ok ? py::object(py::make_tuple(c.min_m, c.mean_m, c.max_m)) :
                           py::object(py::none());
  out["sigmas_px"] = dictOf(c.sigmas);
  out["before_rounding_px"] = dictOf(c.before_rounding);
  out["quantum_px"] = tupleOf(c.quantum);
  out["sigma_point_px"] = tupleOf(c.sigma_point);
  out["depth_exponent"] = tupleOf(c.depth_exponent);
  py::list sizes;
  for (const RegionSizeRow& row : c.by_region_size)
    sizes.append(py::make_tuple(row.size_px, row.regions, tupleOf(row.single)));
  out["by_region_size"] = sizes;
  py::list depths;
  for (const DepthRow& row : c.by_depth)
    depths.append(py::make_tuple(row.mean_m, row.pixels, dictOf(row.sigmas)));
  out["by_depth"] = depths;
  return out;
}

py::dict
calibrate(const py::object& frames, const py::object& sensor, const py::object& region)
{
  const Sensor& seen_by = sensorOf(sensor);
  NoiseCalibrationOptions options;
  options.camera = seen_by.camera;
  options.baseline_m = seen_by.baseline_m;
  options.focal_px = seen_by.disparity_focal_px;
  read("region_px", region, options.region_px);
  std::vector<PointImage> images;
  for (const py::handle& frame : frames)
    images.push_back(imageOf(frame));
  NoiseCalibration result;
  {
    const py::gil_scoped_release release;
    result = calibrateNoise(images, options);
  }
  return dictOf(result);
}

} // namespace

void
bindCalibration(py::module_& module)
{
  module.def(
      "calibrate",
      calibrate,
      py::arg("frames"),
      py::arg("sensor"),
      py::kw_only(),
      py::arg("region_px") = 0,
      "calibrate(frames, sensor, *, region_px=0)\n--\n\n"
      "How large the noise of a stereo or structured-light camera is.\n"
      "\n"
      "Arguments\n"
      "    frames: images (H, W, 3) in m, a sequence of them or one array (F, H, W, "
      "3),\n"
      "        in the camera's frame, of a scene with flat surfaces that does not "
      "move.\n"
      "        Copied into single precision.\n"
      "    sensor: a Sensor, of which camera, baseline and focal length are used.\n"
      "    region_px: side of the regions that planes are fitted to; 0: whole planes.\n"
      "\n"
      "Returns\n"
      "    dict: 'status' ('ok', 'nothing_static', 'nothing_flat'); sigmas of the\n"
      "    disparity, px, in 'sigmas_px' and 'before_rounding_px': 'single' frame,\n"
      "    'temporal', 'fixed' pattern; 'quantum_px', 'sigma_point_px',\n"
      "    'depth_exponent': each (value, low, high) with its 95 % interval, or None\n"
      "    where the data cannot tell; 'by_region_size' [(px, regions, single)] and\n"
      "    'by_depth' [(m, pixels, sigmas)].\n"
      "\n"
      "Raises\n"
      "    TypeError, ValueError: no frame, sizes that differ or are not the "
      "camera's.\n"
      "\n"
      "The interpreter's lock is released while it computes.");
}

} // namespace holdfast::python
