#include <holdfast/pcl/map_conversions.h>

#include <holdfast/pcl/conversions.h>

#include <stdexcept>

namespace holdfast {

std::vector<Measurement>
toMeasurements(const pcl::PointCloud<PatchPoint>& patches, int* left_out)
{
  const Pose sensor = sensorPose(patches.sensor_origin_, patches.sensor_orientation_);
  std::vector<Measurement> measurements;
  int others = 0;
  for (std::size_t i = 0; i < patches.size(); ++i) {
    std::optional<Measurement> m;
    try {
      const ExtractedPatch patch = toExtractedPatch(patches[i]);
      if (isAccepted(patch) && patch.fit.state.centre.allFinite())
        m = measurementOf(patch.fit, sensor);
    }
    catch (const std::invalid_argument&) {
      // Of no type that we know: counted below.
    }
    if (m) {
      m->id = i + 1;
      measurements.push_back(*m);
    }
    else
      ++others;
  }
  if (left_out)
    *left_out = others;
  return measurements;
}

UpdateReport
updateMap(PatchMap& map,
          const pcl::PointCloud<PatchPoint>& patches,
          const Pose& increment,
          const JetMatrix& covariance,
          int* left_out)
{
  if (map.frames() > 0)
    map.move(increment, covariance);
  return map.update(toMeasurements(patches, left_out));
}

pcl::PointCloud<PatchPoint>
toPatchCloud(const PatchMap& map, const FitOptions& options)
{
  std::vector<ExtractedPatch> patches;
  for (const MapPatch& patch : map.patches()) {
    ExtractedPatch extracted;
    extracted.fit = toFitResult(patch, options);
    extracted.radius_m = patch.radius_m;
    extracted.seed_index = patch.epochs;
    patches.push_back(extracted);
  }
  return toPatchCloud(patches, map.pose());
}

} // namespace holdfast
