#include "experiment.h"

#include "command_line.h"
#include "commands.h"
#include "common_options.h"
#include "console.h"
#include "input_options.h"
#include "patch_output.h"

#include <holdfast/io/atomic_file.h>
#include <holdfast/version.h>

#include <CLI/CLI.hpp>
#include <fmt/core.h>

#include <filesystem>
#include <iostream>
#include <memory>
#include <optional>

namespace holdfast::app {
namespace {

namespace fs = std::filesystem;

std::vector<Experiment>
experiments()
{
  return {tableOneExperiment(),
          consistencyExperiment(),
          figureFiveExperiment(),
          figureSixExperiment(),
          neighborhoodsExperiment(),
          pclExperiment(),
          realExperiment(),
          fusionExperiment(),
          mapExperiment(),
          riskExperiment()};
}

struct ExperimentArguments {
  ExperimentSettings settings;
  std::string output_folder; ///< empty: no files
  std::string json_path; ///< empty: none; "-": standard output
  bool quiet = false; ///< errors only
};

/// The command that gives the same rows again: trials and seed always, and whatever
/// else was said but where the results go and on how many threads.
std::string
commandLine(const Experiment& experiment,
            const CLI::App& command,
            const ExperimentSettings& settings)
{
  std::string line = fmt::format("holdfast experiment {} --trials {} --seed {}",
                                 experiment.name,
                                 settings.trials,
                                 settings.seed);
  for (const CLI::Option* option : command.get_options()) {
    if (option->count() == 0 || option->get_group() == "Run")
      continue;
    line += " " + option->get_name();
    if (option->get_items_expected_max() > 0)
      for (const std::string& value : option->results())
        line += " " + value;
  }
  return line;
}

Json
reportJson(const Experiment& experiment,
           const std::string& command,
           const ExperimentSettings& settings,
           const Report& report)
{
  return {{"holdfast", HOLDFAST_VERSION},
          {"experiment", experiment.name},
          {"command", command},
          {"seed", settings.seed},
          {"trials", settings.trials},
          {"rows", report.rows},
          {"remarks", report.remarks}};
}

/// One row per line.
void
writeReportJson(std::ostream& out, Json json)
{
  const Json rows = json["rows"];
  json["rows"] = Json::array();
  const std::string frame = json.dump(2);
  const std::string empty = "\"rows\": []";
  const std::size_t at = frame.find(empty);
  out << frame.substr(0, at) << "\"rows\": [";
  for (std::size_t i = 0; i < rows.size(); ++i)
    out << (i == 0 ? "\n    " : ",\n    ") << rows[i].dump();
  out << "\n  ]" << frame.substr(at + empty.size()) << '\n';
}

/// Where the results go. Outputs that cannot be written are known before the work.
class ExperimentOutput {
public:
  ExperimentOutput(const std::string& name, const ExperimentArguments& arguments)
  : print_json_(arguments.json_path == "-")
  , print_text_(!print_json_ && !arguments.quiet)
  {
    if (!arguments.json_path.empty() && !print_json_)
      json_copy_.emplace(arguments.json_path);
    if (arguments.output_folder.empty())
      return;
    makeFolder(arguments.output_folder);
    const std::string base = (fs::path(arguments.output_folder) / name).string();
    csv_.emplace(base + ".csv");
    json_.emplace(base + ".json");
    svg_.emplace(base + ".svg");
  }

  void write(const Report& report, const Json& json)
  {
    if (print_json_)
      writeReportJson(std::cout, json);
    else if (print_text_)
      std::cout << reportText(report) << std::flush;
    for (std::optional<AtomicFile>* file : {&json_, &json_copy_})
      if (*file)
        writeReportJson((*file)->stream(), json);
    if (csv_)
      writeCsv(csv_->stream(), report.rows);
    if (svg_ && report.plot.panels.empty())
      svg_.reset();
    if (svg_)
      writeSvg(svg_->stream(),
               report.plot,
               "holdfast " HOLDFAST_VERSION ": " + json["command"].get<std::string>());
    commit();
  }

private:
  /// All files or none.
  void commit()
  {
    std::vector<AtomicFile*> files;
    for (std::optional<AtomicFile>* file : {&csv_, &json_, &svg_, &json_copy_})
      if (*file)
        files.push_back(&**file);
    AtomicFile::commit(files);
  }

  bool print_json_;
  bool print_text_;
  std::optional<AtomicFile> json_copy_, csv_, json_, svg_;
};

void
runExperiment(const Experiment& experiment,
              const CLI::App& command,
              const ExperimentRun& run,
              ExperimentArguments& arguments)
{
  ExperimentOutput output(experiment.name, arguments);
  Report report;
  {
    ProgressBar bar(experiment.name, !arguments.quiet);
    arguments.settings.progress = [&bar](int done, int total) {
      bar.update(done, total);
    };
    report = run(arguments.settings);
  }
  const std::string line = commandLine(experiment, command, arguments.settings);
  output.write(report, reportJson(experiment, line, arguments.settings, report));
}

void
addCommonOptions(CLI::App& command,
                 const Experiment& experiment,
                 ExperimentArguments& arguments)
{
  const std::string group = "Run";
  arguments.settings.trials = experiment.default_trials;
  command.add_option("--trials", arguments.settings.trials, experiment.trials_meaning)
      ->check(CLI::Range(experiment.fewest_trials, 100000000, "N"))
      ->type_name("")
      ->capture_default_str()
      ->group(group);
  command.add_option("--seed", arguments.settings.seed, "Start of the random numbers")
      ->check(CLI::Validator(CLI::NonNegativeNumber).description("N"))
      ->type_name("")
      ->capture_default_str()
      ->group(group);
  addThreadsOption(command, arguments.settings.threads)->group(group);
  command
      .add_option("-o,--output",
                  arguments.output_folder,
                  "Write " + experiment.name + ".csv, .json and .svg to this folder")
      ->type_name("DIR")
      ->group(group);
  addJsonOption(command, arguments.json_path)->group(group);
  addQuietOption(command, arguments.quiet)->group(group);
}

void
addExperiment(CLI::App& parent, const Experiment& experiment, int& exit_code)
{
  CLI::App* command = parent.add_subcommand(experiment.name, experiment.summary);
  if (!experiment.former_name.empty())
    command->alias(experiment.former_name);
  const auto arguments = std::make_shared<ExperimentArguments>();
  const ExperimentRun run = experiment.prepare(*command);
  addCommonOptions(*command, experiment, *arguments);
  tidyHelp(*command);
  command->callback([=, &exit_code] {
    runExperiment(experiment, *command, run, *arguments);
    exit_code = 0;
  });
}

} // namespace

void
addExperimentCommand(CLI::App& app, int& exit_code)
{
  CLI::App* command =
      app.add_subcommand("experiment",
                         "Check the covariances, and redo the paper's experiments");
  command->require_subcommand(1);
  command->footer("Examples:\n"
                  "  holdfast experiment table1\n"
                  "  holdfast experiment figure5 --trials 5000 -o results\n"
                  "  holdfast experiment figure6 --data recordings --json -");
  for (const Experiment& experiment : experiments())
    addExperiment(*command, experiment, exit_code);
}

void
addDataOption(CLI::App& command, std::string& folder)
{
  command.add_option("--data", folder, "Folder of recorded clouds")
      ->type_name("DIR")
      ->check(CLI::ExistingDirectory)
      ->envname("HOLDFAST_DATA_DIR")
      ->group("Input");
}

Progress
stageProgress(const Progress& progress, int stage, int stages)
{
  return [=](int done, int total) { progress(stage * total + done, stages * total); };
}

} // namespace holdfast::app
