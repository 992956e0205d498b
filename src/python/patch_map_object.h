/// \file Patches over time as Python has them.
#pragma once

#include <holdfast/geometry/gaussian.h>
#include <holdfast/geometry/rotation.h>
#include <holdfast/io/patch_map_file.h>
#include <holdfast/pcl/frame_mapping.h>

#include <pybind11/pybind11.h>

#include <mutex>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace holdfast::python {

namespace py = pybind11;

/// One motion after another, in the axes of the first frame.
inline Motion
chained(const Motion& first, const Motion& second)
{
  JetMatrix by_first = JetMatrix::Identity(), by_second = JetMatrix::Identity();
  by_first.topLeftCorner<3, 3>() = second.increment.R.transpose();
  by_first.bottomLeftCorner<3, 3>() = -first.increment.R * skew(second.increment.c);
  by_second.bottomRightCorner<3, 3>() = first.increment.R;
  return {first.increment * second.increment,
          propagate(by_first, first.covariance) +
              propagate(by_second, second.covariance)};
}

/// holdfast.PatchMap
class PatchMapObject {
public:
  PatchMapObject(const Sensor& sensor, MappingOptions options)
  : sensor_(sensor), options_(std::move(options)), mapper_(sensor_, options_)
  {}

  PatchMapObject(const Sensor& sensor, MappingOptions options, PatchMap map)
  : sensor_(sensor)
  , options_(std::move(options))
  , mapper_(sensor_, options_, std::move(map))
  {}

  /// The camera moved before the next frame; several motions add up.
  void move(const Motion& next)
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    pending_ = pending_ ? chained(*pending_, next) : next;
  }

  FrameReport update(const RangeCloud& frame, bool find_pose)
  {
    const py::gil_scoped_release release;
    const std::lock_guard<std::mutex> lock(mutex_);
    if (find_pose && pending_)
      throw std::invalid_argument(
          "find_pose: the motion is known already, since move() told it");
    const std::optional<Motion> motion = std::exchange(pending_, std::nullopt);
    if (motion)
      return mapper_.add(frame, *motion);
    return find_pose ? mapper_.addUnknown(frame) : mapper_.addStill(frame);
  }

  /// What read(map) returns, while no update changes it.
  template <typename Read>
  auto ask(Read read) const
  {
    const py::gil_scoped_release release;
    const std::lock_guard<std::mutex> lock(mutex_);
    return read(mapper_.map());
  }

  void save(const std::string& path) const
  {
    ask([&](const PatchMap& map) {
      savePatchMap(path, {map, sensor_.name});
      return 0;
    });
  }

  std::vector<ExtractedPatch> patches() const
  {
    FitOptions open = options_.extraction.fit;
    open.surface = SurfaceRequest::Auto;
    return ask([&](const PatchMap& map) {
      std::vector<ExtractedPatch> patches;
      patches.reserve(map.patches().size());
      for (const MapPatch& patch : map.patches()) {
        ExtractedPatch out;
        out.fit = toFitResult(patch, open);
        out.radius_m = patch.radius_m;
        patches.push_back(std::move(out));
      }
      return patches;
    });
  }

private:
  mutable std::mutex mutex_; ///< held without Python's lock
  Sensor sensor_;
  MappingOptions options_;
  FrameMapper mapper_;
  std::optional<Motion> pending_;
};

/// \throw py::type_error for anything else.
const PatchMapObject& mapOf(py::handle object);

} // namespace holdfast::python
