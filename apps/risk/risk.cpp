#include "commands.h"
#include "common_options.h"
#include "console.h"
#include "risk/risk_layers.h"
#include "risk/risk_report.h"
#include "risk/risk_settings.h"
#include "risk/risk_summary.h"

#include <holdfast/contact/risk_grid.h>
#include <holdfast/io/atomic_file.h>
#include <holdfast/io/foot_file.h>

#include <CLI/CLI.hpp>
#include <fmt/core.h>

#include <iostream>
#include <memory>
#include <stdexcept>

namespace holdfast::app {
namespace {

constexpr const char* kExamples = R"(Examples:
  holdfast risk scene.pcd --foot point_foot -o risk.json
      where a ball foot may step, best first, with what may go wrong there
  holdfast map walk --poses walk/trajectory.txt --radius 0.13 -o walk.map
  holdfast risk walk.map --foot humanoid_foot --best 20 -o risk.json
      the same on a map, for a flat foot whose sole reaches 11 cm
  holdfast render risk.json --color risk -o risk.png
      as a picture
  holdfast risk walk.map --foot my_foot.yaml --layers layers.pcd --resolution 0.01
      every cell of a grid, for planners

The risk of a foothold is the probability that a tolerance of the foot is exceeded by
the surface as it was measured: slip, height, tilt, gap, and the share of the sole over
what was not seen. It says nothing of what was not measured: ground that gives way, the
error of the foot, balance. The result is never "safe".
)";

/// Said where nobody named the load.
void
noteLoad(const RiskReport& report)
{
  printNotice(fmt::format("{}: the load is taken to be along {}, {}; --load-direction "
                          "says otherwise",
                          report.source,
                          vectorText(report.options.load_direction),
                          report.ground.image_down ? "down in the image" :
                                                     "down where z is up"));
}

/// \throw std::runtime_error when the cells would be too many.
RiskGrid
layersOf(const RiskSettings& settings, const RiskReport& report)
{
  RiskGridOptions options;
  options.resolution_m = settings.resolution_m;
  options.yaws = std::max(1, report.options.yaws / 2);
  options.load_direction = report.options.load_direction;
  options.threads = report.options.threads;
  try {
    return riskGrid(report.ground.map, report.foot, options);
  }
  catch (const std::invalid_argument&) { // foot and load were good for the ranking
    throw std::runtime_error(fmt::format(
        "{}: a --resolution of {} m makes more than {} million cells of what was seen",
        settings.layers,
        settings.resolution_m,
        kMaxRiskGridCells / 1'000'000));
  }
}

void
writeFiles(const RiskSettings& settings, const RiskReport& report)
{
  if (settings.output == "-")
    writeRiskJson(std::cout, report);
  else if (!settings.output.empty()) {
    AtomicFile file(settings.output);
    writeRiskJson(file.stream(), report);
    file.commit();
  }
  if (settings.layers.empty())
    return;
  writeLayers(settings.layers, layersOf(settings, report), report.ground.offset);
}

/// Reads what is given, and ranks. What is wrong with an option is said before a cloud
/// is worked on.
RiskReport
ranked(const RiskSettings& settings)
{
  RiskReport report;
  report.source = settings.source;
  report.foot = loadFoot(settings.foot);
  report.options = settings.footholds;
  if (settings.load_given)
    report.options.load_direction =
        Eigen::Map<const Eigen::Vector3d>(settings.load_direction.data());
  if (const std::string error = validityError(report.options); !error.empty())
    throw std::runtime_error(error);
  report.ground = loadGround(settings, report.foot);
  if (!settings.quiet)
    for (const std::string& notice : report.ground.notices)
      printNotice(settings.source + ": " + notice);
  if (!settings.load_given)
    report.options.load_direction = defaultLoadDirection(report.ground);
  report.ranking = rankFootholds(report.ground.map, report.foot, report.options);
  if (const std::string cause = causeOfNone(report); !cause.empty())
    throw std::runtime_error(settings.source + ": " + cause);
  report.regions = planarRegions(report.ground.map);
  return report;
}

void
runRisk(const CLI::App& command, RiskSettings& settings)
{
  finishRiskOptions(command, settings);
  requireNoInput(settings.layers, {settings.source});
  const RiskReport report = ranked(settings);
  if (!settings.load_given && !settings.quiet)
    noteLoad(report);
  writeFiles(settings, report);
  if (!settings.quiet && settings.output != "-")
    std::cout << riskTable(report);
}

} // namespace

void
addRiskCommand(CLI::App& app, int& exit_code)
{
  CLI::App* command = app.add_subcommand(
      "risk",
      "Rank where a foot or finger may touch, by what may go wrong there");
  command->footer(kExamples);
  const auto settings = std::make_shared<RiskSettings>();
  addRiskOptions(*command, *settings);
  command->callback([command, settings, &exit_code] {
    runRisk(*command, *settings);
    exit_code = 0;
  });
}

} // namespace holdfast::app
