#include "collect_summary.h"
#include "command_line.h"
#include "commands.h"
#include "common_options.h"
#include "console.h"
#include "patch_output.h"
#include "result_folder.h"
#include "spool.h"

#include "io/temporary_file.h"

#include <holdfast/io/atomic_file.h>

#include <CLI/CLI.hpp>

#include <filesystem>
#include <iostream>
#include <memory>
#include <stdexcept>

namespace holdfast::app {
namespace {

namespace fs = std::filesystem;

constexpr const char* kExamples = R"(Examples:
  holdfast collect results -o dataset.h5
      the patches of all clouds in one file, and a table of what they are
  python3 -c 'import h5py; print(h5py.File("dataset.h5")["patches/normal"][:5])'
      the first five normals

In the file, /patches has a row for every patch: state and covariance (lower triangle),
parameters, surface, quality, and `cloud`, the number of its row in /clouds, which has
name, path, sensor's pose and number of settings (sensor and options, /settings/json).
/failed lists clouds without results. What only some patches have (mean shifts of second
order, parts of --separate-pattern) and the covariance of the parameters, which follows
from the state's, stay in the JSON.

A run that was killed goes on where it was when started again: until the file is
complete, what has been read is in FILE.holdfast-spool.
)";

/// Rows that are compressed together.
constexpr std::size_t kRowsPerChunk = 4096;

struct CollectSettings {
  std::string folder;
  std::string output;
  std::string json_path;
  bool quiet = false;
};

/// Reads what is not in the spool yet. \return the exit code.
int
fillSpool(const std::vector<ResultSource>& sources, Spool& spool, bool quiet)
{
  int exit_code = 0;
  if (spool.complete() > 0 && !quiet)
    printNotice("going on behind " + std::to_string(spool.complete()) + " of " +
                std::to_string(sources.size()) + " clouds that have been read");
  ProgressBar bar("reading", !quiet);
  while (spool.complete() < sources.size()) {
    const ResultSource& source = sources[spool.complete()];
    try {
      spool.add(source);
    }
    catch (const std::runtime_error& error) {
      printError(error.what());
      exit_code = 1;
      spool.skip(source);
    }
    bar.update(static_cast<int>(spool.complete()), static_cast<int>(sources.size()));
  }
  return exit_code;
}

/// From the spool to columns.
CollectSummary
writeColumnsOf(Spool& spool, const std::string& path)
{
  CollectSummary summary;
  try {
    io::TemporaryFile file(path);
    const auto columns =
        columnFormat().create("/proc/self/fd/" + std::to_string(file.descriptor()),
                              kRowsPerChunk);
    spool.replay({[&](const CloudRow& cloud) {
                    columns->addCloud(cloud);
                    summary.add(cloud);
                  },
                  [&](const PatchRow* rows, std::size_t count) {
                    columns->addPatches(rows, count);
                    for (std::size_t i = 0; i < count; ++i)
                      summary.add(rows[i]);
                  },
                  [&](const FailedCloud& failed) {
                    columns->addFailure(failed);
                    summary.add(failed);
                  }});
    columns->close();
    file.secure();
    file.publish();
  }
  catch (const std::runtime_error& error) {
    throw std::runtime_error(path + ": " + error.what());
  }
  return summary;
}

void
printSummary(const CollectSummary& summary, const CollectSettings& settings)
{
  const auto bytes = static_cast<std::uint64_t>(fs::file_size(settings.output));
  if (summary.fingerprints() > 1)
    printNotice(settings.folder + ": results of " +
                std::to_string(summary.fingerprints()) +
                " kinds of version, options or sensor: clouds/fingerprint");
  if (settings.json_path == "-")
    std::cout << summary.json(settings.output, bytes);
  else if (!settings.quiet)
    std::cout << summary.table(settings.output, bytes);
  if (settings.json_path.empty() || settings.json_path == "-")
    return;
  AtomicFile json(settings.json_path);
  json.stream() << summary.json(settings.output, bytes);
  json.commit();
}

int
runCollect(const CollectSettings& settings)
{
  const fs::path parent = fs::absolute(settings.output).parent_path();
  checkFolder(parent.string());
  columnFormat(); // rather than after the reading
  const std::vector<ResultSource> sources = resultsIn(settings.folder);
  Spool spool(settings.output + ".holdfast-spool", sources);
  const int exit_code = fillSpool(sources, spool, settings.quiet);
  const CollectSummary summary = writeColumnsOf(spool, settings.output);
  spool.remove();
  printSummary(summary, settings);
  return exit_code;
}

} // namespace

void
addCollectCommand(CLI::App& app, int& exit_code)
{
  CLI::App* command =
      app.add_subcommand("collect", "Collect the patches of many clouds in columns");
  command->footer(kExamples);
  const auto settings = std::make_shared<CollectSettings>();
  command
      ->add_option("DIR", settings->folder, "Folder of results, as fit -o writes them")
      ->required();
  command->add_option("-o,--output", settings->output, "Write this HDF5 file")
      ->required()
      ->type_name("FILE")
      ->group("Output");
  addJsonOption(*command, settings->json_path, "the summary");
  addQuietOption(*command, settings->quiet);
  tidyHelp(*command);
  command->callback([settings, &exit_code] { exit_code = runCollect(*settings); });
}

} // namespace holdfast::app
