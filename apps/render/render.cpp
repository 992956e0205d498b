#include "commands.h"
#include "console.h"
#include "render_risk.h"
#include "render_scene.h"
#include "render_settings.h"
#include "result_input.h"
#include "stroke_font.h"

#include <holdfast/geometry/constants.h>
#include <holdfast/io/atomic_file.h>
#include <holdfast/io/patch_io.h>
#include <holdfast/patch/tessellation.h>
#include <holdfast/simulation/reference_scenes.h>

#include <CLI/CLI.hpp>
#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>

namespace holdfast::app {
namespace {

namespace fs = std::filesystem;

constexpr const char* kExamples = R"(Examples:
  holdfast fit scene.pcd -o results
  holdfast render results/scene.patches.json -o scene.png
      the cloud as the sensor sees it, with patches coloured by type
  holdfast render results/scene.patches.json -o sure.png --color sigma-normal
      where normals are sure and where they are not
  holdfast render results/scene.patches.json -o top.png --view 0,90 --zoom 2
      from straight above, the middle twice as large
  holdfast render results/*.patches.json -o sheet.png --size 1600x1200
      a sheet of several results
  holdfast render risk.json -o risk.png --color risk
      what 'holdfast risk' has found, and the soles of its footholds
  holdfast render --types -o types.png
      the ten types of patches

Points have the colours of the cloud file (rgb), else they are grey and shaded. Scales
are logarithmic and end where 5 % of the patches lie beyond. "Above" is along the z axis
of the cloud, or upwards in the image where the cloud is in the frame of its camera.
)";

constexpr int kMargin = 12; // px, about the legend
constexpr int kTop = 4; // px, above titles
constexpr int kTitleHeight = 20; // px, of one line

/// One result as it is drawn.
struct Subject {
  std::string title;
  std::vector<ExtractedPatch> patches;
  SeenCloud cloud;
  bool is_measured = true; ///< the cloud; else it is made of the patches
  std::vector<Rgb> colors; ///< of the patches one by one; empty: as the legend has them
  std::vector<PictureSole> soles;
};

/// The cloud of a result. \throw std::runtime_error when it cannot be found.
std::string
cloudOf(const std::string& result, const std::string& cloud)
{
  if (auto found = findCloud(result, cloud))
    return *found;
  throw std::runtime_error(result + ": its cloud " + cloud +
                           " is neither here nor beside it: --cloud FILE tells where");
}

/// Those that are to be drawn. What a map knows too little of to be a patch cannot be,
/// which is said.
std::vector<ExtractedPatch>
patchesOf(const std::string& result,
          const PatchReport& report,
          const RenderSettings& settings)
{
  std::vector<ExtractedPatch> patches = report.result.patches;
  if (report.is_of_map) {
    const auto end =
        std::remove_if(patches.begin(), patches.end(), [](const ExtractedPatch& patch) {
          return !isUsable(patch.fit.status);
        });
    if (end != patches.end() && !settings.quiet)
      printNotice(fmt::format(
          "{}: {} patches are not drawn, since the map knows too little of them",
          result,
          patches.end() - end));
    patches.erase(end, patches.end());
  }
  return settings.max_patches ?
             evenShare(patches, static_cast<std::size_t>(*settings.max_patches)) :
             patches;
}

/// A map has no cloud: what it has seen is drawn as its surfaces are.
Subject
mapSubject(const std::string& name, std::vector<ExtractedPatch> patches)
{
  constexpr double kSpacing = 0.01; // m
  Subject subject;
  subject.is_measured = false;
  for (const ExtractedPatch& patch : patches) {
    const Mesh mesh = tessellate(patch.fit.patch, kSpacing);
    subject.cloud.points.positions.insert(subject.cloud.points.positions.end(),
                                          mesh.vertices.begin(),
                                          mesh.vertices.end());
  }
  subject.title = fmt::format("{}, {} patches", name, patches.size());
  subject.patches = std::move(patches);
  return subject;
}

/// Points and sensor of a cloud.
Subject
cloudSubject(const std::string& path,
             const CloudReading& reading,
             const RenderSettings& settings)
{
  std::vector<std::string> notices;
  Subject subject;
  subject.cloud = loadSeenCloud(path, settings.input, reading, notices);
  for (const std::string& notice : notices)
    if (!settings.quiet)
      printNotice(path + ": " + notice);
  if (!subject.cloud.seen && !settings.aside && !settings.quiet)
    printNotice(path + ": not seen from a sensor, so drawn as with --view iso");
  return subject;
}

Subject
riskSubject(const std::string& result, const RenderSettings& settings)
{
  const std::string text = readResultText(result);
  RiskPicture risk;
  try {
    risk = readRisk(text);
  }
  catch (const std::runtime_error& error) {
    throw std::runtime_error(result + ": " + error.what());
  }
  Subject subject;
  if (!settings.cloud.empty())
    subject = cloudSubject(settings.cloud, risk.reading, settings);
  else if (risk.is_of_map)
    subject = mapSubject(risk.source, risk.patches);
  else
    subject = cloudSubject(cloudOf(result, risk.source), risk.reading, settings);
  subject.title = fmt::format("{}, {} footholds on {} patches",
                              fs::path(risk.source).filename().string(),
                              risk.soles.size(),
                              risk.patches.size());
  subject.patches = std::move(risk.patches);
  subject.colors = std::move(risk.colors);
  subject.soles = std::move(risk.soles);
  return subject;
}

Subject
loadSubject(const std::string& result, const RenderSettings& settings)
{
  if (settings.risk)
    return riskSubject(result, settings);
  const PatchReport report = parseResult(result, readResultText(result));
  if (report.result.patches.empty())
    throw std::runtime_error(result + ": has no patch");
  std::vector<ExtractedPatch> patches = patchesOf(result, report, settings);
  if (report.is_of_map && settings.cloud.empty())
    return mapSubject(report.cloud, std::move(patches));
  const std::string path =
      settings.cloud.empty() ? cloudOf(result, report.cloud) : settings.cloud;
  Subject subject = cloudSubject(path, readingOf(report), settings);
  subject.patches = std::move(patches);
  subject.title = fmt::format("{}, {} {}",
                              fs::path(path).filename().string(),
                              subject.patches.size(),
                              subject.patches.size() == 1 ? "patch" : "patches");
  return subject;
}

View
viewFromAside(const Subject& subject, const Aside& aside)
{
  const Standpoint standpoint = standpointOf(subject.cloud);
  const double radian = kPi / 180.0;
  return View::orbit(standpoint.front,
                     standpoint.up,
                     radian * aside.azimuth,
                     radian * aside.elevation);
}

View
viewOf(const Subject& subject, const RenderSettings& settings)
{
  return subject.cloud.seen && !settings.aside ?
             View::perspective(subject.cloud.sensor_pose) :
             viewFromAside(subject, settings.aside.value_or(Aside()));
}

/// Equal frames for `count` pictures, row by row.
std::vector<Frame>
grid(const Frame& all, int count, int columns)
{
  constexpr int kLeast = 64; // px; the title takes a third
  const int rows = (count + columns - 1) / columns;
  if (std::min(all.width() / columns, all.height() / rows) < kLeast)
    throw CLI::ValidationError("--size", "is too small for what the picture shows");
  std::vector<Frame> frames;
  for (int i = 0; i < count; ++i) {
    const int column = i % columns, row = i / columns;
    frames.push_back({all.left + all.width() * column / columns,
                      all.top + all.height() * row / rows,
                      all.left + all.width() * (column + 1) / columns,
                      all.top + all.height() * (row + 1) / rows});
  }
  return frames;
}

/// Dark or light, whichever stands out.
Rgb
textColor(const Rgb& background)
{
  const int green_counts_most = 3 * background[0] + 6 * background[1] + background[2];
  return green_counts_most > 1275 ? Rgb{40, 40, 40} : Rgb{225, 225, 225};
}

/// Writes lines over the top of the frame. \return what is left of it.
Frame
drawTitle(Canvas& canvas,
          const Frame& frame,
          const std::vector<std::string>& lines,
          const Rgb& color)
{
  Frame rest = frame;
  canvas.clip(frame);
  for (const std::string& line : lines) {
    drawText(canvas,
             0.5 * (frame.left + frame.right),
             rest.top + 15,
             shortened(line, frame.width() - 8),
             TextAlign::Centre,
             color);
    rest.top += kTitleHeight;
  }
  return rest;
}

void
drawSubject(Canvas& canvas,
            const Frame& frame,
            const Subject& subject,
            const PatchColors& colors,
            const RenderSettings& settings)
{
  View view = viewOf(subject, settings);
  view.fit(subject.cloud.points.positions, frame, settings.zoom);
  canvas.clip(frame);
  drawPoints(canvas, view, frame, subject.cloud.points);
  // Glass shows what lies behind it, which has to be there first.
  std::vector<std::pair<double, std::size_t>> from_afar;
  for (std::size_t i = 0; i < subject.patches.size(); ++i)
    if (const auto at = view.project(subject.patches[i].fit.patch.c))
      from_afar.emplace_back(at->nearness, i);
  std::sort(from_afar.begin(), from_afar.end());
  // Where the cloud is made of the patches, each has points all over.
  const PatchSupport support(subject.is_measured ? subject.cloud.points.positions :
                                                   std::vector<Eigen::Vector3d>());
  for (const auto& [nearness, i] : from_afar) {
    const FitResult& fit = subject.patches[i].fit;
    const bool has_own = !subject.colors.empty();
    drawPatch(canvas,
              view,
              fit.patch,
              subject.is_measured ? support.of(fit.patch) : SupportedCells(),
              has_own ? subject.colors[i] : colors(fit),
              has_own ? PatchEdge::None : PatchEdge::Line); // soles have the edges
  }
  // The best last, over the others.
  for (auto sole = subject.soles.rbegin(); sole != subject.soles.rend(); ++sole)
    drawSole(canvas, view, *sole);
}

void
renderResults(Canvas& canvas, const RenderSettings& settings)
{
  std::vector<Subject> subjects;
  std::vector<ExtractedPatch> all_patches;
  for (const std::string& result : settings.results) {
    const Subject& subject = subjects.emplace_back(loadSubject(result, settings));
    all_patches.insert(all_patches.end(),
                       subject.patches.begin(),
                       subject.patches.end());
  }
  const PatchColors colors(settings.measure, all_patches);
  const Rgb text = textColor(settings.background);
  const Frame whole = canvas.frame();
  const int legend_height = settings.risk ?
                                riskLegendHeight() :
                                colors.legendHeight(whole.width() - 2 * kMargin);
  const int legend_top = whole.bottom - kMargin - legend_height;
  const Frame legend{kMargin, legend_top, whole.right - kMargin, whole.bottom};
  if (settings.risk)
    drawRiskLegend(canvas, legend, text);
  else
    colors.drawLegend(canvas, legend, text);
  const int count = static_cast<int>(subjects.size());
  const int columns = static_cast<int>(std::ceil(std::sqrt(count)));
  const std::vector<Frame> frames =
      grid({0, kTop, whole.right, legend_top - kMargin}, count, columns);
  for (std::size_t i = 0; i < subjects.size(); ++i)
    drawSubject(canvas,
                drawTitle(canvas, frames[i], {subjects[i].title}, text),
                subjects[i],
                colors,
                settings);
}

/// "elliptic paraboloid", "ellipse, 10 parameters".
std::vector<std::string>
typeTitle(PatchType type)
{
  return {spacedName(type.surface),
          std::string(boundaryName(type.boundary)) + ", " +
              std::to_string(degreesOfFreedom(type)) + " parameters"};
}

void
renderTypes(Canvas& canvas, const RenderSettings& settings)
{
  constexpr int kColumns = 5;
  constexpr double kAzimuth = -0.6, kElevation = 0.6; // rad
  const Frame whole = canvas.frame();
  const std::vector<Frame> frames = grid({0, kTop, whole.right, whole.bottom},
                                         static_cast<int>(kPatchTypes.size()),
                                         kColumns);
  for (std::size_t i = 0; i < kPatchTypes.size(); ++i) {
    const PatchType type = kPatchTypes[i];
    const Patch patch = tableTwoScene(type).scene.patches.front();
    const Frame frame =
        drawTitle(canvas, frames[i], typeTitle(type), textColor(settings.background));
    View view = View::orbit(-Eigen::Vector3d::UnitY(),
                            Eigen::Vector3d::UnitZ(),
                            kAzimuth,
                            kElevation);
    view.fit(tessellate(patch, 0.05).vertices, frame, 0.8 * settings.zoom);
    canvas.clip(frame);
    drawSolidPatch(canvas, view, patch, surfaceColor(type.surface));
  }
}

void
runRender(const RenderSettings& settings)
{
  checkRenderSettings(settings);
  AtomicFile file(settings.output);
  Canvas canvas(settings.width, settings.height, settings.background);
  if (settings.types)
    renderTypes(canvas, settings);
  else
    renderResults(canvas, settings);
  canvas.writePng(file.stream());
  file.commit();
}

} // namespace

void
addRenderCommand(CLI::App& app, int& exit_code)
{
  CLI::App* command =
      app.add_subcommand("render", "Draw patches on their cloud as a picture");
  command->footer(kExamples);
  const auto settings = std::make_shared<RenderSettings>();
  addRenderOptions(*command, *settings);
  command->callback([settings, &exit_code] {
    runRender(*settings);
    exit_code = 0;
  });
}

} // namespace holdfast::app
