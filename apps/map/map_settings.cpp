#include "map/map_settings.h"

#include "command_line.h"
#include "common_options.h"

#include <CLI/CLI.hpp>

namespace holdfast::app {
namespace {

void
addPoseOptions(CLI::App& command, MapSettings& settings)
{
  const std::string group = "Poses";
  command
      .add_option(
          "--poses",
          settings.poses,
          "Where the camera was at each frame: lines 't tx ty tz qx qy qz qw' "
          "(TUM), one for each frame in their order, or by the time stamps that "
          "the names of the frames are; none: found from the patches")
      ->type_name("FILE|none")
      ->group(group);
  command
      .add_option("--pose-sigma",
                  settings.pose_sigma,
                  "How far the step from frame to frame may be off, as standard "
                  "deviations of its rotation, rad, and its translation, m, along each "
                  "axis (default: 0.001 0.001, which is said)")
      ->check(positiveNumber(""))
      ->type_name("RAD M")
      ->group(group);
}

} // namespace

void
addMapOptions(CLI::App& command, MapSettings& settings)
{
  addInputOptions(command, settings.input);
  addNoPatternOption(command, settings.no_pattern);
  addPoseOptions(command, settings);
  command.add_option("--frames", settings.frames, "Take the first N frames only")
      ->check(CLI::Range(1, 100000000, "N"))
      ->type_name("");
  command
      .add_option("--resume",
                  settings.resume,
                  "Go on with a map (*.map) of this sensor")
      ->type_name("MAP");
  command
      .add_option("-o,--output",
                  settings.output.files,
                  "FILE.json: the patches as 'fit' writes them, each with what the map "
                  "knows of it; FILE.map: the map itself, to go on with; may be given "
                  "twice")
      ->type_name("FILE");
  command
      .add_option("--ply",
                  settings.output.ply,
                  "Write the patches as one coloured mesh")
      ->type_name("FILE");
  addExtractionOptions(command, settings.extraction);
  addQuietOption(command, settings.quiet);
  tidyHelp(command);
}

void
finishMapOptions(const CLI::App& command, MapSettings& settings)
{
  finishExtractionOptions(command, settings.extraction);
  settings.pose_sigma_given = command.count("--pose-sigma") > 0;
  const SurfaceRequest surface = settings.extraction.options.fit.surface;
  if (surface != SurfaceRequest::Auto && surface != SurfaceRequest::Paraboloid)
    throw CLI::ValidationError("--surface",
                               "what is fused is always a paraboloid; auto or "
                               "paraboloid say what becomes of it in the results");
  if (settings.extraction.options.sampler.neighborhood == Neighborhood::Knn)
    throw CLI::ValidationError("--neighborhood",
                               "a map wants neighbourhoods of one radius, not knn");
  for (const std::string& output : settings.output.files)
    if (!isMapOutput(output))
      throw CLI::ValidationError("--output", output + " is neither *.json nor *.map");
  if (settings.pose_sigma_given && (settings.poses.empty() || settings.poses == "none"))
    throw CLI::ValidationError("--pose-sigma", "goes with --poses FILE");
}

} // namespace holdfast::app
