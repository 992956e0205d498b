#include "fit_settings.h"

#include <CLI/CLI.hpp>

#include <algorithm>
#include <utility>

namespace holdfast {
namespace {

template <typename Enum>
using Choices = std::vector<std::pair<std::string, Enum>>;

const Choices<SurfaceRequest> kSurfaces{
    {"auto", SurfaceRequest::Auto},
    {"paraboloid", SurfaceRequest::Paraboloid},
    {"plane", SurfaceRequest::Plane},
    {"sphere", SurfaceRequest::Sphere},
    {"cylinder", SurfaceRequest::CircularCylinder},
    {"elliptic-paraboloid", SurfaceRequest::EllipticParaboloid},
    {"hyperbolic-paraboloid", SurfaceRequest::HyperbolicParaboloid},
    {"cylindric-paraboloid", SurfaceRequest::CylindricParaboloid},
    {"circular-paraboloid", SurfaceRequest::CircularParaboloid}};

const Choices<BoundaryType> kBoundaries{{"ellipse", BoundaryType::Ellipse},
                                        {"circle", BoundaryType::Circle},
                                        {"rectangle", BoundaryType::Rectangle},
                                        {"quad", BoundaryType::Quad}};

const Choices<Neighborhood> kNeighborhoods{{"disc", Neighborhood::Disc},
                                           {"ball", Neighborhood::Ball},
                                           {"geodesic", Neighborhood::Geodesic},
                                           {"knn", Neighborhood::Knn}};

const Choices<SeedStrategy> kSeedStrategies{{"grid", SeedStrategy::Grid},
                                            {"random", SeedStrategy::Random},
                                            {"poisson", SeedStrategy::Poisson}};

const Choices<CovarianceMode> kCovarianceModes{
    {"exact", CovarianceMode::Exact},
    {"gauss-newton", CovarianceMode::GaussNewton},
    {"second-order", CovarianceMode::SecondOrder},
    {"stagewise", CovarianceMode::Stagewise},
    {"monte-carlo", CovarianceMode::MonteCarlo}};

const Choices<Residual> kResiduals{{"sampson", Residual::Sampson},
                                   {"ray", Residual::Ray}};

/// An option whose values have names; `value` may be an optional.
template <typename Enum, typename Value>
CLI::Option*
addChoice(CLI::App& command,
          const std::string& name,
          Value& value,
          const Choices<Enum>& choices,
          const std::string& description)
{
  std::vector<std::string> names;
  for (const auto& choice : choices)
    names.push_back(choice.first);
  const auto assign = [&value, &choices](const std::string& chosen) {
    for (const auto& [choice, meaning] : choices)
      if (choice == chosen)
        value = meaning;
  };
  return command.add_option_function<std::string>(name, assign, description)
      ->type_name("")
      ->check(CLI::IsMember(names));
}

void
addNeighborhoodOptions(CLI::App& command, SamplerOptions& sampler)
{
  const std::string group = "Seeds and neighbourhoods";
  command
      .add_option("--radius", sampler.radius_m, "Radius of the neighbourhoods, metres")
      ->check(positiveNumber("M"))
      ->type_name("")
      ->capture_default_str()
      ->group(group);
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
  command
      .add_option("--max-patches",
                  sampler.max_patches,
                  "Stop after so many patches, those turned down not counted")
      ->check(CLI::Range(1, 100000000, "N"))
      ->type_name("")
      ->group(group);
  command
      .add_option("--max-area",
                  sampler.max_area_m2,
                  "Stop when the patches cover this much surface together, square "
                  "metres; what lies in several counts once")
      ->check(positiveNumber("M2"))
      ->type_name("")
      ->group(group);
  command
      .add_option("--max-time",
                  sampler.max_time_s,
                  "Stop after this time, seconds; how many patches that are depends on "
                  "the computer")
      ->check(positiveNumber("S"))
      ->type_name("")
      ->group(group);
  addChoice(
      command,
      "--neighborhood",
      sampler.neighborhood,
      kNeighborhoods,
      "Points around a seed: pixels within the image of the radius, points within "
      "it, the same along the surface, or the --k nearest")
      ->default_str("disc")
      ->group(group);
  command.add_option("--k", sampler.k, "Points of a knn neighbourhood")
      ->check(CLI::Range(3, 100000000, "N"))
      ->type_name("")
      ->capture_default_str()
      ->group(group);
  addChoice(
      command,
      "--seed-strategy",
      sampler.strategy,
      kSeedStrategies,
      "Where seeds lie: on a regular grid, anywhere, or anywhere but never closer "
      "than the spacing")
      ->default_str("grid")
      ->group(group);
  command
      .add_option("--random-seed",
                  sampler.random_seed,
                  "Start of the random numbers; the grid draws none")
      ->check(CLI::Validator(CLI::NonNegativeNumber).description("N"))
      ->type_name("")
      ->capture_default_str()
      ->group(group);
}

void
addPatchOptions(CLI::App& command, FitSettings& settings)
{
  const std::string group = "Patches";
  FitOptions& fit = settings.extraction.fit;
  command.add_flag("--whole", settings.whole, "One patch to all points of the cloud")
      ->group(group);
  addChoice(command,
            "--surface",
            fit.surface,
            kSurfaces,
            "Surface to fit; auto: a paraboloid whose kind, or flatness, the points "
            "decide; paraboloid: the same, but never a plane")
      ->default_str("auto")
      ->group(group);
  addChoice(command,
            "--boundary",
            fit.plane_boundary,
            kBoundaries,
            "Boundary of planes; other surfaces imply theirs (default: ellipse)")
      ->group(group);
  command
      .add_option("--containment",
                  fit.containment,
                  "Share of the points the boundary encloses per axis, between 0 and 1")
      ->type_name("SHARE")
      ->capture_default_str()
      ->group(group);
  command
      .add_option("--curvature-tolerance",
                  fit.curvature_tolerance_per_m,
                  "Curvatures below it count as zero, 1/metre")
      ->type_name("PER_M")
      ->capture_default_str()
      ->group(group);
  addChoice(command,
            "--residual",
            fit.residual,
            kResiduals,
            "Distance to minimise: first order, or exact along the noise")
      ->default_str("ray")
      ->group(group);
  command
      .add_flag(
          "--paper",
          settings.paper,
          "The choices of Kanoulas, Tsagarakis and Vona 2016 wherever ours differ")
      ->group(group);
}

void
addValidationOptions(CLI::App& command, ValidationOptions& limits)
{
  const std::string group = "Validation";
  const auto add = [&](const std::string& name,
                       std::optional<double>& limit,
                       const CLI::Validator& valid,
                       const std::string& description) {
    command
        .add_option_function<double>(
            name,
            [&limit](double value) { limit = value; },
            description)
        ->check(valid)
        ->type_name("")
        ->group(group);
  };
  add("--max-curvature",
      limits.max_curvature_per_m,
      positiveNumber("PER_M"),
      "Turn down patches with a larger principal curvature, 1/metre");
  add("--max-residual",
      limits.max_residual_m,
      positiveNumber("M"),
      "Turn down patches with a larger rms distance of their points from the surface, "
      "metres");
  add("--min-coverage",
      limits.min_coverage,
      CLI::Range(0.0, 1.0, "SHARE"),
      "Turn down patches of which points support a smaller share, 0 to 1");
  add("--max-chi2",
      limits.max_chi2_per_dof,
      positiveNumber("RATIO"),
      "Turn down patches with a larger chi-square per degree of freedom");
}

void
addRunOptions(CLI::App& command, FitSettings& settings)
{
  addChoice(command,
            "--covariance",
            settings.extraction.covariance,
            kCovarianceModes,
            "Covariance of the parameters: exact to first order; its Gauss-Newton "
            "approximation; with second-order terms; the paper's chain of stages; or "
            "1000 refits to resampled points")
      ->default_str("exact")
      ->group("Patches");
  command
      .add_option(
          "-o,--output",
          settings.output_folder,
          "Write NAME.patches.json, NAME.patches.pcd (points with normals, parameters "
          "and covariances) and NAME.patches.ply (coloured mesh) here")
      ->type_name("DIR")
      ->group("Output");
  command
      .add_option("--json",
                  settings.json_path,
                  "Write JSON to this file, or with - to standard output and nothing "
                  "else there; one object per cloud, each on a line of its own")
      ->type_name("FILE")
      ->group("Output");
  command
      .add_flag("--quiet", settings.quiet, "Errors only: no table, notices or progress")
      ->group("Output");
  command
      .add_option("--threads",
                  settings.extraction.threads,
                  "Threads to use, 0: all cores; results do not depend on it")
      ->check(CLI::Range(0, 4096, "N"))
      ->type_name("")
      ->capture_default_str()
      ->group("Output");
}

/// Options of `command` that do not go with a given other one.
void
exclude(CLI::App& command,
        const std::string& option,
        const std::vector<std::string>& others)
{
  for (const std::string& other : others)
    command.get_option(option)->excludes(command.get_option(other));
}

} // namespace

void
addFitOptions(CLI::App& command, FitSettings& settings)
{
  addInputOptions(command, settings.input);
  addPatchOptions(command, settings);
  addNeighborhoodOptions(command, settings.extraction.sampler);
  addValidationOptions(command, settings.extraction.validation.emplace());
  addRunOptions(command, settings);
  exclude(command,
          "--whole",
          {"--radius",
           "--spacing",
           "--seeds",
           "--max-patches",
           "--max-area",
           "--max-time",
           "--neighborhood",
           "--k",
           "--seed-strategy"});
  exclude(command, "--paper", {"--residual"});
  tidyHelp(command);
}

void
finishFitSettings(const CLI::App& command, FitSettings& settings)
{
  FitOptions& fit = settings.extraction.fit;
  if (settings.paper) {
    FitOptions paper = FitOptions::paper();
    paper.surface = fit.surface;
    paper.plane_boundary = fit.plane_boundary;
    if (command.count("--containment") > 0)
      paper.containment = fit.containment;
    if (command.count("--curvature-tolerance") > 0)
      paper.curvature_tolerance_per_m = fit.curvature_tolerance_per_m;
    fit = paper;
  }
  const SamplerOptions& sampler = settings.extraction.sampler;
  const bool knn = sampler.neighborhood == Neighborhood::Knn;
  if (command.count("--k") > 0 && !knn)
    throw CLI::ValidationError("--k", "needs --neighborhood knn");
  if (command.count("--radius") > 0 && knn)
    throw CLI::ValidationError("--radius", "does not go with --neighborhood knn");
  if (fit.plane_boundary && fit.surface != SurfaceRequest::Auto &&
      fit.surface != SurfaceRequest::Plane)
    throw CLI::ValidationError("--boundary", "goes with --surface plane or auto only");
  if (!(fit.containment > 0.0 && fit.containment < 1.0))
    throw CLI::ValidationError("--containment", "must lie between 0 and 1");
  if (!(fit.curvature_tolerance_per_m >= 0.0))
    throw CLI::ValidationError("--curvature-tolerance", "must not be negative");
  if (const std::string error = validityError(fit); !error.empty())
    throw CLI::ValidationError("fit", error);
}

} // namespace holdfast
