#include "extraction_options.h"

#include "command_line.h"
#include "common_options.h"
#include "console.h"

#include <holdfast/fit/names.h>
#include <holdfast/geometry/constants.h>
#include <holdfast/pcl/names.h>
#include <holdfast/uncertainty/names.h>

#include <CLI/CLI.hpp>

namespace holdfast::app {
namespace {

/// What a patch may be, and what decides it.
void
addTypeOptions(CLI::App& command, FitOptions& fit, const std::string& group)
{
  addChoice(command,
            "--surface",
            fit.surface,
            kSurfaceRequestNames,
            "Surface to fit; auto: a paraboloid whose kind, or flatness, the points "
            "decide; paraboloid: the same, but never a plane; cylinder is short for "
            "circular_cylinder",
            {"cylinder", SurfaceRequest::CircularCylinder})
      ->default_str("auto")
      ->group(group);
  addChoice(command,
            "--boundary",
            fit.plane_boundary,
            kBoundaryNames,
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
  command
      .add_option("--flat-within",
                  fit.flat_within_m,
                  "A surface that bends by less than this within its patch counts as a "
                  "plane, metres; default: what the points can tell from one is none")
      ->check(positiveNumber("M"))
      ->type_name("")
      ->group(group);
}

// Of addPatchOptions(): what else is wanted of the covariance.
void
addSeparatePattern(CLI::App& command, FitOptions& fit)
{
  command
      .add_flag(
          "--separate-pattern",
          fit.separate_pattern,
          "Give the parts of the state's covariance apart that points share and do "
          "not share: only the latter averages over frames of a still camera")
      ->group("Patches");
}

void
addPatchOptions(CLI::App& command, ExtractionSettings& settings)
{
  const std::string group = "Patches";
  FitOptions& fit = settings.options.fit;
  addTypeOptions(command, fit, group);
  addChoice(command,
            "--residual",
            fit.residual,
            kResidualNames,
            "Distance to minimise: first order, or exact along the noise")
      ->default_str("ray")
      ->group(group);
  command
      .add_flag(
          "--paper",
          settings.paper,
          "The choices of Kanoulas, Tsagarakis and Vona 2016 wherever ours differ")
      ->group(group);
  addChoice(command,
            "--covariance",
            settings.options.covariance,
            kCovarianceModeNames,
            "Covariance of the parameters: exact to first order; its Gauss-Newton "
            "approximation; with second-order terms; the paper's chain of stages; 1000 "
            "refits to resampled points; or exact, with second-order terms where the "
            "parameters need them")
      ->default_str("exact")
      ->group(group);
  addSeparatePattern(command, fit);
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
  command
      .add_option(
          "--max-patches",
          sampler.max_patches,
          "Give the best so many patches, spread over the scene by the spacing; "
          "live: stop after so many")
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
  addChoice(
      command,
      "--neighborhood",
      sampler.neighborhood,
      kNeighborhoodNames,
      "Points around a seed: those whose rays meet its surface within the radius, "
      "pixels within the image of the radius, points within it, the same along paths "
      "over the points, or the --k nearest")
      ->default_str("patch")
      ->group(group);
  command.add_option("--k", sampler.k, "Points of a knn neighbourhood")
      ->check(CLI::Range(3, 100000000, "N"))
      ->type_name("")
      ->capture_default_str()
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
addOverlapOption(CLI::App& command, double& max_overlap)
{
  command
      .add_option("--no-overlap",
                  max_overlap,
                  "Leave out patches of which better ones have more than this share of "
                  "the points, 0 to 1")
      ->check(CLI::Range(0.0, 1.0, "SHARE"))
      ->type_name("")
      ->group("Seeds and neighbourhoods");
}

constexpr EnumNames<Accept, 2> kAcceptNames{{"default", "all"}};

// Of addValidationOptions(): limits in terms of the radius of the neighbourhoods.
void
addLimitsInRadii(CLI::App& command, ValidationOptions& limits)
{
  const auto add = [&](const std::string& name,
                       std::optional<double>& limit,
                       const std::string& description) {
    command
        .add_option_function<double>(
            name,
            [&limit](double value) { limit = value; },
            description + ", in radii of its neighbourhood")
        ->check(positiveNumber("RADII"))
        ->type_name("")
        ->default_str(formatNumber("%.3g", *limit))
        ->group("Validation");
  };
  add("--max-extent",
      limits.max_extent,
      "Turn down patches whose points reach further from the centre (a full disc: 1)");
  add("--max-sagitta",
      limits.max_sagitta,
      "Turn down patches that rise higher over their tangent plane");
  add("--max-bend", limits.max_bend, "Turn down patches of a larger curvature");
  add("--max-departure",
      limits.max_departure,
      "Turn down patches with a point further from the surface, and further than its "
      "noise explains");
  add("--max-noise",
      limits.max_noise,
      "Turn down patches whose single points are less sure (rms)");
}

void
addValidationOptions(CLI::App& command, ExtractionSettings& settings)
{
  ValidationOptions& limits = settings.options.validation.emplace();
  const std::string group = "Validation";
  addChoice(
      command,
      "--accept",
      settings.accept,
      kAcceptNames,
      "Patches that keep the limits, or all, in JSON and mesh, with their verdict")
      ->default_str("default")
      ->group(group);
  addLimitsInRadii(command, limits);
  command
      .add_option(
          "--max-view-angle",
          settings.max_view_angle_deg,
          "Turn down patches that are seen at a larger angle from their normal, "
          "degrees")
      ->check(CLI::Range(1.0, 90.0, "DEG"))
      ->type_name("")
      ->capture_default_str()
      ->group(group);
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
      "Turn down patches of which points support a smaller share, 0 to 1 (default "
      "0.5)");
  add("--max-stray",
      limits.max_stray,
      positiveNumber("SHARE"),
      "Turn down patches of which a larger share of the pixels that see them measured "
      "points elsewhere (default 0.02)");
  add("--max-chi2",
      limits.max_chi2_per_dof,
      positiveNumber("RATIO"),
      "Turn down patches with a larger chi-square over what it should be (default 3)");
}

} // namespace

void
addExtractionOptions(CLI::App& command, ExtractionSettings& settings)
{
  addPatchOptions(command, settings);
  addNeighborhoodOptions(command, settings.options.sampler);
  addOverlapOption(command, settings.options.max_overlap);
  addValidationOptions(command, settings);
  addThreadsOption(command, settings.options.threads);
  exclude(command, "--paper", {"--residual"});
}

void
finishExtractionOptions(const CLI::App& command, ExtractionSettings& settings)
{
  FitOptions& fit = settings.options.fit;
  if (settings.paper) {
    FitOptions paper = FitOptions::paper();
    paper.surface = fit.surface;
    paper.plane_boundary = fit.plane_boundary;
    if (command.count("--containment") > 0)
      paper.containment = fit.containment;
    if (command.count("--flat-within") > 0)
      paper.flat_within_m = fit.flat_within_m;
    if (command.count("--curvature-tolerance") > 0)
      paper.curvature_tolerance_per_m = fit.curvature_tolerance_per_m;
    fit = paper;
  }
  settings.options.keep_turned_down = settings.accept == Accept::All;
  settings.options.validation->max_view_angle_rad =
      settings.max_view_angle_deg * kPi / 180.0;
  const SamplerOptions& sampler = settings.options.sampler;
  const bool knn = sampler.neighborhood == Neighborhood::Knn;
  if (command.count("--k") > 0 && !knn)
    throw CLI::ValidationError("--k", "needs --neighborhood knn");
  if (command.count("--radius") > 0 && knn)
    throw CLI::ValidationError("--radius", "does not go with --neighborhood knn");
  if (fit.plane_boundary && fit.surface != SurfaceRequest::Auto &&
      fit.surface != SurfaceRequest::Plane)
    throw CLI::ValidationError("--boundary", "goes with --surface plane or auto only");
  if (!(fit.containment >= kSmallestContainment &&
        fit.containment <= kLargestContainment))
    throw CLI::ValidationError("--containment", "must lie between 0.001 and 0.999999");
  if (!(fit.curvature_tolerance_per_m >= 0.0))
    throw CLI::ValidationError("--curvature-tolerance", "must not be negative");
  if (const std::string error = validityError(fit); !error.empty())
    throw CLI::ValidationError("fit", error);
}

} // namespace holdfast::app
