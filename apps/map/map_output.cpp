#include "map/map_output.h"

#include <holdfast/io/atomic_file.h>
#include <holdfast/io/patch_io.h>
#include <holdfast/io/patch_map_file.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <utility>

namespace holdfast::app {
namespace {

bool
isJson(const std::string& path)
{
  return std::filesystem::path(path).extension() == ".json";
}

/// The map as the patches of one cloud.
PatchReport
reportOf(const PatchMap& map,
         const MapSource& source,
         const std::vector<FitResult>& fits)
{
  PatchReport report;
  report.cloud = source.name;
  report.file = source.file;
  report.sensor_pose = map.pose();
  report.options = source.options;
  report.result.sensor = source.sensor;
  report.result.points = source.points;
  report.result.notices = source.notices;
  report.map = &map;
  for (std::size_t i = 0; i < fits.size(); ++i) {
    ExtractedPatch patch;
    patch.fit = fits[i];
    patch.radius_m = map.patches()[i].radius_m;
    report.result.patches.push_back(std::move(patch));
  }
  return report;
}

} // namespace

void
MapSource::addFrame(const ExtractionResult& frame)
{
  points += frame.points;
  sensor.camera = frame.sensor.camera;
  for (const std::string& notice : frame.notices)
    addNotice(notice);
}

bool
MapSource::addNotice(const std::string& notice)
{
  if (std::find(notices.begin(), notices.end(), notice) != notices.end())
    return false;
  notices.push_back(notice);
  return true;
}

bool
isMapOutput(const std::string& path)
{
  return isJson(path) || std::filesystem::path(path).extension() == ".map";
}

std::vector<FitResult>
fitsOf(const PatchMap& map, const FitOptions& options)
{
  std::vector<FitResult> fits;
  for (const MapPatch& patch : map.patches())
    fits.push_back(toFitResult(patch, options));
  return fits;
}

void
writeMap(const PatchMap& map,
         const MapSource& source,
         const std::vector<FitResult>& fits,
         const MapOutput& output)
{
  const PatchReport report = reportOf(map, source, fits);
  std::vector<std::unique_ptr<AtomicFile>> files;
  std::vector<AtomicFile*> pointers;
  const auto open = [&](const std::string& path) -> std::ostream& {
    files.push_back(std::make_unique<AtomicFile>(path));
    pointers.push_back(files.back().get());
    return files.back()->stream();
  };
  for (const std::string& path : output.files)
    if (isJson(path))
      writeJson(open(path), report, JsonLayout::PatchPerLine);
    else
      writePatchMap(open(path), {map, source.sensor.name});
  if (!output.ply.empty())
    writeMesh(open(output.ply), report.result.patches, false);
  AtomicFile::commit(pointers);
}

} // namespace holdfast::app
