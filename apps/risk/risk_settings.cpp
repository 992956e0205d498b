#include "risk/risk_settings.h"

#include "command_line.h"
#include "common_options.h"
#include "risk/risk_layers.h"

#include <holdfast/io/foot_file.h>

#include <CLI/CLI.hpp>

#include <filesystem>

namespace holdfast::app {
namespace {

void
addFootOptions(CLI::App& command, RiskSettings& settings)
{
  const std::string group = "Foot";
  std::string known;
  for (const std::string& name : listFeet())
    known += (known.empty() ? "" : ", ") + name;
  command
      .add_option("--foot",
                  settings.foot,
                  "Sole, ankle, friction and tolerances, a YAML file or one of: " +
                      known)
      ->required()
      ->type_name("NAME|FILE")
      ->group(group);
  command
      .add_option(
          "--load-direction",
          settings.load_direction,
          "Of the force on the ground, frame of the map or cloud, of any length "
          "(default: 0 0 -1, and 0 1 0, down in the image, for a cloud in the "
          "frame of its camera; which one is said)")
      ->type_name("X Y Z")
      ->group(group);
}

void
addRankingOptions(CLI::App& command, RiskSettings& settings)
{
  const std::string group = "Ranking";
  command
      .add_option_function<int>(
          "--best",
          [&settings](int best) { settings.best = best; },
          "Give the best N footholds (default: all; the table shows 10)")
      ->check(CLI::Range(1, 100000000, "N"))
      ->type_name("")
      ->group(group);
  command
      .add_option("--yaws",
                  settings.footholds.yaws,
                  "Directions of the sole to try over a full turn; layers take a half "
                  "of them")
      ->check(CLI::Range(1, 3600, "N"))
      ->type_name("")
      ->capture_default_str()
      ->group(group);
  command
      .add_option("--spacing",
                  settings.footholds.spacing_m,
                  "Least distance between two footholds, metres; 0: every patch")
      ->check(nonNegativeNumber("M"))
      ->type_name("")
      ->capture_default_str()
      ->group(group);
  command
      .add_option_function<double>(
          "--radius",
          [&settings](double radius) { settings.radius_m = radius; },
          "Of the patches of a cloud, metres (default: 1.1 times what the sole "
          "reaches, "
          "and at least 0.04)")
      ->check(positiveNumber("M"))
      ->type_name("")
      ->group(group);
}

void
addOutputOptions(CLI::App& command, RiskSettings& settings)
{
  const std::string group = "Output";
  command
      .add_option("-o,--output",
                  settings.output,
                  "Write footholds, patches and planar regions as JSON; - for standard "
                  "output, and nothing else there")
      ->type_name("FILE.json")
      ->group(group);
  command
      .add_option(
          "--layers",
          settings.layers,
          "Write the risk of every cell of a grid: *.png a picture of the total "
          "risk, green to red; *.pcd every layer as a field; *.tif one page of "
          "32-bit floats for each layer")
      ->type_name("FILE")
      ->group(group);
  command
      .add_option("--resolution",
                  settings.resolution_m,
                  "Side of a cell of the layers, metres")
      ->check(positiveNumber("M"))
      ->type_name("")
      ->capture_default_str()
      ->group(group);
  addQuietOption(command, settings.quiet);
}

} // namespace

bool
isMapFile(const std::string& path)
{
  return std::filesystem::path(path).extension() == ".map";
}

void
addRiskOptions(CLI::App& command, RiskSettings& settings)
{
  command
      .add_option("MAP|CLOUD",
                  settings.source,
                  "FILE.map, as holdfast map -o writes it, or a cloud, of which a map "
                  "of one frame is made")
      ->required();
  settings.footholds.threads = 0;
  addFootOptions(command, settings);
  addRankingOptions(command, settings);
  addOutputOptions(command, settings);
  addSensorOptions(command, settings.input);
  addNoPatternOption(command, settings.no_pattern);
  addThreadsOption(command, settings.footholds.threads);
  tidyHelp(command);
}

void
finishRiskOptions(const CLI::App& command, RiskSettings& settings)
{
  const bool is_map = isMapFile(settings.source);
  for (const char* option : {"--radius", "--sensor", "--no-pattern"})
    if (is_map && command.count(option) > 0)
      throw CLI::ValidationError(option,
                                 "goes with a cloud, and " + settings.source +
                                     " is a map");
  if (!settings.output.empty() && settings.output != "-" &&
      std::filesystem::path(settings.output).extension() != ".json")
    throw CLI::ValidationError("--output", settings.output + " is not *.json");
  if (!settings.layers.empty() && !isLayerFile(settings.layers))
    throw CLI::ValidationError("--layers",
                               settings.layers + " is neither *.png nor *.pcd nor "
                                                 "*.tif");
  if (command.count("--resolution") > 0 && settings.layers.empty())
    throw CLI::ValidationError("--resolution", "goes with --layers");
  settings.load_given = command.count("--load-direction") > 0;
  if (settings.best)
    settings.footholds.max_footholds = *settings.best;
}

} // namespace holdfast::app
