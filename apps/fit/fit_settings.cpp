#include "fit_settings.h"

#include "command_line.h"
#include "common_options.h"

#include <holdfast/pcl/names.h>

#include <CLI/CLI.hpp>

#include <string>
#include <vector>

namespace holdfast::app {
namespace {

/// What takes the place of a sensor where there was none, or several places of it.
void
addSurveyOptions(CLI::App& command, FitSettings& settings)
{
  command
      .add_option("--sigma",
                  settings.sigma_m,
                  "Noise of every point in every direction, metres, in place of the "
                  "sensor's: for laser scanners, surveys and models")
      ->check(positiveNumber("M"))
      ->type_name("")
      ->group("Input");
  addNoPatternOption(command, settings.no_pattern);
  addChoice(command,
            "--orient",
            settings.extraction.options.normal_side,
            kNormalSideNames,
            "Side of the normals: that of the sensor; away from the middle of the "
            "cloud, for models seen from all sides; or that of +z, for ground surveys")
      ->default_str("viewpoint")
      ->group("Input");
}

void
addSeedOptions(CLI::App& command, SamplerOptions& sampler)
{
  const std::string group = "Seeds and neighbourhoods";
  command.add_option("--spacing", sampler.spacing_m, "Distance between seeds, metres")
      ->check(positiveNumber("M"))
      ->type_name("")
      ->capture_default_str()
      ->group(group);
  command
      .add_option("--seeds",
                  sampler.max_seeds,
                  "Most seeds; default: as --spacing gives")
      ->check(CLI::Range(1, 100000000, "N"))
      ->type_name("")
      ->group(group);
  addChoice(
      command,
      "--seed-strategy",
      sampler.strategy,
      kSeedStrategyNames,
      "Where seeds lie: on a regular grid, anywhere, or anywhere but never closer "
      "than the spacing")
      ->default_str("grid")
      ->group(group);
  command
      .add_option("--max-time",
                  sampler.max_time_s,
                  "Stop after this time, seconds; how many patches that are depends on "
                  "the computer")
      ->check(positiveNumber("S"))
      ->type_name("")
      ->group(group);
}

/// What takes the place of seeds all over the cloud.
void
addExtentOptions(CLI::App& command, FitSettings& settings)
{
  command.add_flag("--whole", settings.whole, "One patch to all points of the cloud")
      ->group("Patches");
  command
      .add_option(
          "--dense",
          settings.dense_stride,
          "A patch at every so many pixels of a depth image or organized cloud, "
          "across and down; -o writes an organized NAME.dense.pcd, and as images "
          "(NAME.LAYER.pfm in floats, .png to look at) normal, kappa_min, "
          "kappa_max (1/metre), sigma_normal (rad) and chi2_ratio")
      ->check(CLI::Range(1, 65535, "STRIDE"))
      ->type_name("")
      ->group("Patches");
}

/// What says nothing where every pixel, or every so many pixels, is asked for.
void
excludeFromExtents(CLI::App& command)
{
  const std::vector<std::string> of_both{"--spacing",
                                         "--seeds",
                                         "--max-patches",
                                         "--max-area",
                                         "--max-time",
                                         "--seed-strategy"};
  exclude(command, "--whole", of_both);
  exclude(command, "--whole", {"--dense", "--radius", "--neighborhood", "--k"});
  exclude(command, "--dense", of_both);
  exclude(command, "--dense", {"--random-seed", "--no-overlap", "--accept", "--json"});
}

void
addOutputOptions(CLI::App& command, FitSettings& settings)
{
  command
      .add_option(
          "-o,--output",
          settings.output_folder,
          "Write NAME.patches.json, NAME.patches.pcd (points with normals, parameters "
          "and covariances) and NAME.patches.ply (coloured mesh) here")
      ->type_name("DIR")
      ->group("Output");
  addJsonOption(command,
                settings.json_path,
                "one object per cloud, each on a line of its own");
  addQuietOption(command, settings.quiet);
}

constexpr EnumNames<BatchFormat, 2> kBatchFormatNames{{"json", "h5"}};

/// Many clouds in one process of many.
void
addBatchOptions(CLI::App& command, FitSettings& settings)
{
  const std::string group = "Data sets";
  command.get_option("CLOUD")->required(false);
  command
      .add_option("--manifest",
                  settings.manifest,
                  "List of clouds, one path per line; behind a tab a name for its "
                  "results where that of the file will not do")
      ->type_name("LIST")
      ->group(group);
  command
      .add_option_function<std::string>(
          "--shard",
          [&settings](const std::string& text) { settings.shard = *parseShard(text); },
          "Of N parts of the list the I-th, 1 <= I <= N; names decide which cloud "
          "belongs where, so that more clouds move none")
      ->check(CLI::Validator(
          [](const std::string& text) {
            return parseShard(text) ? std::string() : text + " is no part I/N";
          },
          "I/N"))
      ->type_name("")
      ->group(group);
  command
      .add_flag("--resume",
                settings.resume,
                "Leave clouds whose results, or record of failure, are there and were "
                "made by the same version, options and sensor")
      ->group(group);
  command
      .add_flag("--retry-failed", settings.retry_failed, "But try those that failed")
      ->needs(command.get_option("--resume"))
      ->group(group);
  addChoice(command,
            "--format",
            settings.format,
            kBatchFormatNames,
            "Write the files of -o, or columns, NAME.patches.h5, which take a sixth of "
            "the space")
      ->default_str("json")
      ->group(group);
}

} // namespace

void
finishBatchOptions(const CLI::App& command, const FitSettings& settings)
{
  if (!settings.manifest.empty()) {
    if (settings.output_folder.empty())
      throw CLI::ValidationError("--manifest", "needs -o");
    return;
  }
  for (const char* option : {"--shard", "--resume", "--format"})
    if (command.count(option) > 0)
      throw CLI::ValidationError(option, "goes with --manifest only");
  if (settings.input.clouds.empty())
    throw CLI::RequiredError("CLOUD");
}

void
addFitOptions(CLI::App& command, FitSettings& settings)
{
  addInputOptions(command, settings.input);
  addSurveyOptions(command, settings);
  addExtentOptions(command, settings);
  addExtractionOptions(command, settings.extraction);
  addSeedOptions(command, settings.extraction.options.sampler);
  addOutputOptions(command, settings);
  addBatchOptions(command, settings);
  excludeFromExtents(command);
  exclude(command, "--manifest", {"CLOUD", "--dense", "--json"});
  tidyHelp(command);
}

} // namespace holdfast::app
