// Patches of clouds.
#include "bindings.h"

#include "cloud.h"
#include "extract_keywords.h"
#include "patch_objects.h"
#include "sensor_object.h"

#include <cmath>
#include <utility>

namespace holdfast::python {
namespace {

struct ExtractRequest {
  ExtractionOptions options;
  bool validate = true;
  bool whole = false;
};

const Keywords<ExtractRequest>&
extractKeywords()
{
  static const Keywords<ExtractRequest> keywords = [] {
    Keywords<ExtractRequest> k("extract");
    k.add(
         "whole",
         [](ExtractRequest& r) -> bool& { return r.whole; },
         "one patch to all points; no seeds, no neighbourhoods.")
        .add(
            "validate",
            [](ExtractRequest& r) -> bool& { return r.validate; },
            "False: no patch is checked. The limits of the checks, None each for "
            "none:\n"
            "        max_extent to max_chi2_per_dof.");
    addExtractionOptions(k, [](ExtractRequest& r) -> ExtractionOptions& {
      return r.options;
    });
    return k;
  }();
  return keywords;
}

/// Back into the caller's frame.
void
shift(const Eigen::Vector3d& offset, std::vector<ExtractedPatch>& patches)
{
  if (offset.isZero(0.0))
    return;
  for (ExtractedPatch& patch : patches) {
    patch.fit.patch.c += offset;
    patch.fit.state.centre += offset;
    patch.seed += offset;
  }
}

/// A sensor's noise means nothing for points in another unit.
void
requireUnitOf(const Sensor& sensor, const RangeCloud& cloud)
{
  if (cloud.hasCovariances())
    return;
  py::ssize_t measured = 0, too_far = 0;
  const Eigen::Vector3f camera = cloud.sensor_pose.c.cast<float>();
  for (const pcl::PointXYZ& point : *cloud.points) {
    const double distance = (point.getVector3fMap() - camera).norm();
    measured += std::isfinite(distance) ? 1 : 0;
    too_far += distance > farthestOf(sensor) ? 1 : 0;
  }
  requireSameUnit(too_far, measured, sensor);
}

PatchesObject
extract(const py::object& points,
        const py::object& sensor,
        const py::object& covariances,
        const py::object& sensor_pose,
        const py::kwargs& given)
{
  const Sensor& seen_by = sensorOf(sensor);
  ExtractRequest request;
  extractKeywords().set(request, given);
  const RangeCloud cloud = cloudOf(points, covariances, sensor_pose);
  requireUnitOf(seen_by, cloud);
  if (!request.validate)
    request.options.validation.reset();
  const auto source = std::make_shared<PatchSource>();
  std::vector<ExtractedPatch> patches;
  {
    const py::gil_scoped_release release;
    source->options = request.options;
    source->result = request.whole ? extractWhole(cloud, seen_by, request.options) :
                                     extractPatches(cloud, seen_by, request.options);
    patches = std::move(source->result.patches);
    source->result.patches.clear();
    shift(cloud.offset, patches);
  }
  source->sensor_pose = cloud.sensor_pose;
  source->sensor_pose.c += cloud.offset;
  source->covariances_of_cloud = cloud.hasCovariances();
  return PatchesObject(std::move(patches), source);
}

std::string
extractHelp()
{
  return documented(
      "extract(points, sensor, *, covariances=None, sensor_pose=None, " +
          extractKeywords().signature() + ")",
      "Find the patches of a cloud or a depth image, each with its covariance.\n"
      "\n"
      "    >>> sensor = holdfast.Sensor.load('kinect_v1')\n"
      "    >>> patches = holdfast.extract(sensor.points(depth), sensor, "
      "radius_m=0.05)\n"
      "    >>> steady = patches[patches.normal_sigma < 0.05]\n"
      "    >>> steady.centre, steady.normal                  # (N, 3), (N, 3)\n"
      "\n"
      "Arguments\n"
      "    points: an image (H, W, 3) or a cloud (N, 3), in m; NaN where nothing was\n"
      "        measured. Copied in any case, into single precision (about 0.1 um at 1 "
      "m);\n"
      "        coordinates too large for that are shifted there and back.\n"
      "    sensor: a Sensor, whose noise the points have.\n"
      "    covariances: of the points in place of the sensor's, m^2: one more axis or "
      "two\n"
      "        than an image or cloud has points, (..., 6) or (..., 3, 3).\n"
      "    sensor_pose: (4, 4) of the camera in the frame of the points. None: the "
      "points\n"
      "        are in the camera's own frame, x right, y down, z forward.\n" +
          extractKeywords().help() +
          "\n"
          "Returns\n"
          "    Patches in the order of their seeds, in the frame of the points. What "
          "was\n"
          "    left out and why is in `rejected`, `turned_down`, `accounting`, and "
          "what\n"
          "    was assumed in `notices`: look at them when there are fewer than "
          "expected.\n"
          "\n"
          "Raises\n"
          "    TypeError: an argument is of another kind, or there is no such option.\n"
          "    ValueError: a shape, a number or a name is wrong, or no point is "
          "finite.\n"
          "\n"
          "The interpreter's lock is released while it computes; the result is the "
          "same\n"
          "for any number of threads, bit for bit, unless max_time_s ends it.");
}

} // namespace

void
bindExtract(py::module_& module)
{
  module.def("extract",
             extract,
             py::arg("points"),
             py::arg("sensor"),
             py::kw_only(),
             py::arg("covariances") = py::none(),
             py::arg("sensor_pose") = py::none(),
             extractHelp().c_str());
}

} // namespace holdfast::python
