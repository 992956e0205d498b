#include "command_line.h"
#include "commands.h"
#include "common_options.h"
#include "console.h"
#include "report/glb.h"
#include "report/page_data.h"
#include "report/report_result.h"

#include <holdfast/io/atomic_file.h>

#include <CLI/CLI.hpp>
#include <fmt/core.h>

#include <filesystem>
#include <memory>
#include <ostream>

namespace holdfast::app {
namespace {

constexpr const char* kExamples = R"(Examples:
  holdfast fit scene.pcd -o results
  holdfast report results/scene.patches.json -o scene.html
      one file to open in a browser, or to send to somebody
  holdfast report results/*.patches.json -o all.html
      several results, to choose from on the page
  holdfast report walk.json --cloud walk.ply -o walk.html
      a map of 'holdfast map', with points to go with it
  holdfast report walk.json risk.json -o walk.html
      the map with what 'holdfast risk walk.map' has found on it
  holdfast report risk.json -o risk.html
      the same without the map's covariances, or a risk on a cloud
  holdfast report results/scene.patches.json --glb scene.glb
      the patches and their uncertainty for any viewer of glTF

The page shows cloud and patches in 3D with the uncertainty of centres and normals, a
table to filter and sort, every number of a patch, histograms, and what was left out and
why; of a risk the soles where they may step, and a table of them. It asks for nothing from anywhere. Where it would become larger than --max-size its
clouds are thinned, and it says so.
)";

constexpr std::size_t kMostResults = 200; // of a recording of many frames

struct ReportSettings {
  std::vector<std::string> results;
  std::string cloud; ///< empty: the one a result names
  std::string page; ///< file; empty: none
  std::string glb; ///< file; empty: none
  double max_size_mb = 2.0;
  double magnification = 10.0; ///< of ellipsoids in glTF
  bool quiet = false; ///< errors only
  InputOptions input; ///< of clouds that are depth images
};

CLI::Validator
named(const std::string& extension, const std::string& what)
{
  return CLI::Validator(
      [extension, what](const std::string& path) {
        const bool is_named = std::filesystem::path(path).extension() == extension;
        return is_named ? "" : path + ": " + what + "; name it *" + extension;
      },
      "");
}

void
addReportOptions(CLI::App& command, ReportSettings& settings)
{
  command
      .add_option("RESULT",
                  settings.results,
                  "JSON as holdfast fit, map, live and risk write it: "
                  "NAME.patches.json, a map, a risk, or lines of objects")
      ->required();
  command.add_option("-o,--output", settings.page, "Page to write")
      ->check(named(".html", "the report is a page"))
      ->type_name("FILE.html");
  command
      .add_option("--glb", settings.glb, "Binary glTF of patches, ellipsoids and soles")
      ->check(named(".glb", "binary glTF"))
      ->type_name("FILE.glb");
  command
      .add_option("--magnification",
                  settings.magnification,
                  "How many times as large as they are ellipsoids are in --glb")
      ->check(CLI::Range(1.0, 1000.0, "X"))
      ->type_name("")
      ->capture_default_str();
  command
      .add_option("--max-size",
                  settings.max_size_mb,
                  "Of the page, MB (1000000 bytes): clouds are thinned for it")
      ->check(CLI::Range(1.0, 1000.0, "MB"))
      ->type_name("")
      ->capture_default_str();
  command
      .add_option("--cloud",
                  settings.cloud,
                  "Cloud to show below the patches; default: the one RESULT names, in "
                  "the working folder or beside RESULT, read as it was for it")
      ->type_name("FILE")
      ->group("Input");
  addSensorOptions(command, settings.input);
  addQuietOption(command, settings.quiet);
  tidyHelp(command);
}

/// Every result of every file, or an even share of them where they are too many.
std::vector<ReportResult>
readResults(const ReportSettings& settings)
{
  std::vector<ReportResult> results;
  for (const std::string& path : settings.results)
    for (ReportResult& result : readReportResults(path))
      results.push_back(std::move(result));
  joinRisks(results);
  const std::size_t count = results.size();
  if (count <= kMostResults)
    return results;
  if (!settings.quiet)
    printNotice(fmt::format("{} of {} results are shown, spread evenly over them",
                            kMostResults,
                            count));
  std::vector<ReportResult> share;
  for (std::size_t i = 0; i < kMostResults; ++i)
    share.push_back(std::move(results[i * count / kMostResults]));
  return share;
}

void
addClouds(std::vector<ReportResult>& results, const ReportSettings& settings)
{
  if (!settings.cloud.empty() && results.size() > 1)
    throw CLI::ValidationError("--cloud", "goes with a single result only");
  std::vector<std::string> notices;
  for (ReportResult& result : results)
    addCloud(result, settings.cloud, settings.input, notices);
  for (const ReportResult& result : results)
    if (!result.cloud && namesCloud(result))
      notices.push_back(result.source + ": " + result.cloud_note);
  for (const std::string& notice : notices)
    if (!settings.quiet)
      printNotice(notice);
}

void
runReport(const ReportSettings& settings)
{
  if (settings.page.empty() && settings.glb.empty())
    throw CLI::ValidationError("--output", "is needed, or --glb");
  std::vector<std::unique_ptr<AtomicFile>> files;
  const auto open = [&](const std::string& path) -> std::ostream& {
    return files.emplace_back(std::make_unique<AtomicFile>(path))->stream();
  };
  std::ostream* page = settings.page.empty() ? nullptr : &open(settings.page);
  std::ostream* glb = settings.glb.empty() ? nullptr : &open(settings.glb);
  std::vector<ReportResult> results = readResults(settings);
  addClouds(results, settings);
  if (page != nullptr)
    *page << reportPage(results, static_cast<std::size_t>(1e6 * settings.max_size_mb));
  if (glb != nullptr)
    *glb << toGlb(results, settings.magnification);
  std::vector<AtomicFile*> pointers;
  for (const auto& file : files)
    pointers.push_back(file.get());
  AtomicFile::commit(pointers);
}

} // namespace

void
addReportCommand(CLI::App& app, int& exit_code)
{
  CLI::App* command = app.add_subcommand(
      "report",
      "Write a page that shows results in a browser: 3D, table, numbers");
  command->footer(kExamples);
  const auto settings = std::make_shared<ReportSettings>();
  addReportOptions(*command, *settings);
  command->callback([settings, &exit_code] {
    runReport(*settings);
    exit_code = 0;
  });
}

} // namespace holdfast::app
