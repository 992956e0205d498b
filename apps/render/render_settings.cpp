#include "render_settings.h"

#include "command_line.h"
#include "common_options.h"

#include <CLI/CLI.hpp>

#include <cmath>
#include <filesystem>

namespace holdfast::app {
namespace {

constexpr const char* kByType = "type";
constexpr const char* kByRisk = "risk";

/// The two numbers of "A<separator>B", or nothing.
template <typename Number>
std::optional<std::pair<Number, Number>>
parsePair(const std::string& text, char separator)
{
  const std::size_t at = text.find(separator);
  if (at == std::string::npos)
    return std::nullopt;
  const auto first = parseNumber<Number>(text.substr(0, at));
  const auto second = parseNumber<Number>(text.substr(at + 1));
  if (!first || !second)
    return std::nullopt;
  return std::pair(*first, *second);
}

/// An option whose text is understood by `parse`, which returns what is wrong with it.
CLI::Option*
addParsed(CLI::App& command,
          const std::string& name,
          const std::function<std::string(const std::string&)>& parse,
          const std::string& description)
{
  return command
      .add_option_function<std::string>(
          name,
          [name, parse](const std::string& text) {
            if (const std::string error = parse(text); !error.empty())
              throw CLI::ValidationError(name, "'" + text + "' " + error);
          },
          description)
      ->group("Picture");
}

std::string
parseColoring(const std::string& text, RenderSettings& settings)
{
  settings.measure = nullptr;
  settings.risk = text == kByRisk;
  std::string known = kByType;
  for (const Measure& measure : measures()) {
    if (isSameName(text, measure.name))
      settings.measure = &measure;
    known += ", " + measure.name;
  }
  const bool is_known = settings.measure != nullptr || settings.risk || text == kByType;
  return is_known ? "" : "is none of " + known + ", " + kByRisk;
}

std::string
parseView(const std::string& text, RenderSettings& settings)
{
  settings.aside.reset();
  if (text == "camera")
    return "";
  settings.aside.emplace();
  if (text == "iso")
    return "";
  const auto angles = parsePair<double>(text, ',');
  if (!angles || !(std::abs(angles->first) <= 360.0) ||
      !(std::abs(angles->second) <= 90.0))
    return "is neither camera nor iso nor AZIMUTH,ELEVATION within 360 and 90 degrees";
  settings.aside = Aside{angles->first, angles->second};
  return "";
}

std::string
parseSize(const std::string& text, RenderSettings& settings)
{
  constexpr int kLeast = 200, kMost = 4096; // px; the most take 1.4 GB of memory
  const auto size = parsePair<int>(text, 'x');
  if (!size || std::min(size->first, size->second) < kLeast ||
      std::max(size->first, size->second) > kMost)
    return "is not WIDTHxHEIGHT, from 200x200 to 4096x4096";
  settings.width = size->first;
  settings.height = size->second;
  return "";
}

std::string
parseBackground(const std::string& text, RenderSettings& settings)
{
  const std::string hex = text == "white" ? "#ffffff" :
                          text == "black" ? "#000000" :
                                            text;
  if (hex.size() != 7 || hex[0] != '#' ||
      hex.find_first_not_of("0123456789abcdefABCDEF", 1) != std::string::npos)
    return "is neither white nor black nor #rrggbb";
  for (std::size_t i = 0; i < settings.background.size(); ++i)
    settings.background[i] =
        static_cast<std::uint8_t>(std::stoi(hex.substr(1 + 2 * i, 2), nullptr, 16));
  return "";
}

std::string
requirePng(const std::string& path)
{
  const bool is_png = std::filesystem::path(path).extension() == ".png";
  return is_png ? "" : path + ": the picture is written as PNG; name it *.png";
}

void
addSubjectOptions(CLI::App& command, RenderSettings& settings)
{
  command.add_option(
      "RESULT",
      settings.results,
      "NAME.patches.json, as holdfast fit -o writes it, or a result of map "
      "or risk; several give a sheet of pictures with one legend");
  command.add_option("-o,--output", settings.output, "Picture to write")
      ->required()
      ->check(requirePng)
      ->type_name("FILE.png");
  CLI::Option* cloud =
      command
          .add_option("--cloud",
                      settings.cloud,
                      "Cloud to draw below the patches; default: the one RESULT names, "
                      "in the working folder or beside RESULT, read as it was for it")
          ->type_name("FILE")
          ->group("Input");
  command
      .add_flag("--types",
                settings.types,
                "The ten types of patches instead of results")
      ->excludes(cloud);
  addSensorOptions(command, settings.input);
  addQuietOption(command, settings.quiet);
}

void
addPictureOptions(CLI::App& command, RenderSettings& settings)
{
  const auto parseInto = [&settings](auto parse) {
    return
        [&settings, parse](const std::string& text) { return parse(text, settings); };
  };
  addParsed(command,
            "--color",
            parseInto(parseColoring),
            "What colours show: the type of surface; sigma of the normal (degrees) or "
            "centre (mm), from the covariance; chi-square over its degrees of "
            "freedom; or, of a result of 'holdfast risk', the total risk, with the "
            "soles of its footholds")
      ->type_name("type|sigma-normal|sigma-centre|chi2|risk")
      ->default_str(kByType);
  addParsed(command,
            "--view",
            parseInto(parseView),
            "As the sensor sees it; from aside; or from AZ degrees to the right of the "
            "sensor's side and EL above the ground, parallel lines staying parallel")
      ->type_name("camera|iso|AZ,EL")
      ->default_str("camera");
  addParsed(command, "--size", parseInto(parseSize), "Of the picture, px")
      ->type_name("WxH")
      ->default_str("960x720");
  command.add_option("--zoom", settings.zoom, "Enlarges the middle of the picture")
      ->check(CLI::Range(0.01, 1000.0, "X"))
      ->type_name("")
      ->capture_default_str()
      ->group("Picture");
  addParsed(command,
            "--background",
            parseInto(parseBackground),
            "Behind the cloud; words are dark or light to suit")
      ->type_name("white|black|#rrggbb")
      ->default_str("white");
  command
      .add_option("--max-patches",
                  settings.max_patches,
                  "Draw at most this many patches of a result, spread evenly over it")
      ->check(CLI::Range(1, 100000000, "N"))
      ->type_name("")
      ->group("Picture");
}

} // namespace

void
addRenderOptions(CLI::App& command, RenderSettings& settings)
{
  addSubjectOptions(command, settings);
  addPictureOptions(command, settings);
  for (const char* option : {"--color", "--view", "--max-patches"})
    command.get_option("--types")->excludes(command.get_option(option));
  tidyHelp(command);
}

void
checkRenderSettings(const RenderSettings& settings)
{
  if (settings.types != settings.results.empty())
    throw CLI::ValidationError("RESULT",
                               settings.types ? "does not go with --types" :
                                                "a result is needed, or --types");
  if (settings.risk && settings.max_patches)
    throw CLI::ValidationError("--max-patches",
                               "does not go with --color risk: 'holdfast risk --best' "
                               "says how many soles there are");
  if (!settings.cloud.empty() && settings.results.size() > 1)
    throw CLI::ValidationError("--cloud", "goes with a single RESULT only");
}

} // namespace holdfast::app
