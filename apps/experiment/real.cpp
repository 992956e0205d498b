// Are covariances right on a real camera? Patches on recorded planes about the plane of
// the whole.
#include "console.h"
#include "experiment.h"
#include "other_poses.h"

#include <holdfast/geometry/constants.h>
#include <holdfast/geometry/rotation.h>
#include <holdfast/patch_estimator.h>
#include <holdfast/uncertainty/monte_carlo.h>

#include "pcl/point_gatherer.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>

namespace holdfast::app {
namespace {

struct DiscSize {
  int radius_px;
  int stride_px;
};
constexpr std::array<DiscSize, 5> kSizes{{{10, 1}, {16, 1}, {25, 1}, {25, 4}, {35, 6}}};

constexpr double kLeastInside = 0.98; // of the pixels of a disc
constexpr int kErrors = 3; // height and two tilts
constexpr double kChiSquare95 = 7.814728; // of three degrees of freedom

// The discs.

using Disc = std::vector<int>; ///< indices into the cloud

/// Every stride-th pixel about one that is inside the plane; empty where the disc
/// reaches beyond it.
Disc
discAt(const RecordedCloud& recording, const DiscSize& size, int column, int row)
{
  const int width = static_cast<int>(recording.cloud.points->width);
  const int height = static_cast<int>(recording.cloud.points->height);
  const int steps = size.radius_px / size.stride_px;
  Disc disc;
  int all = 0;
  for (int j = -steps; j <= steps; ++j)
    for (int i = -steps; i <= steps; ++i) {
      const int du = i * size.stride_px, dv = j * size.stride_px;
      if (du * du + dv * dv > size.radius_px * size.radius_px)
        continue;
      const int u = column + du, v = row + dv;
      ++all;
      if (u >= 0 && v >= 0 && u < width && v < height &&
          recording.plane.inside[static_cast<std::size_t>(v * width + u)])
        disc.push_back(v * width + u);
    }
  return static_cast<double>(disc.size()) < kLeastInside * all ? Disc() : disc;
}

/// Discs about a grid half overlap, so that no place counts for more than others; where
/// that are more than wanted, a random choice of them.
std::vector<Disc>
discsOn(const RecordedCloud& recording,
        const DiscSize& size,
        int most,
        std::mt19937_64 generator)
{
  const int width = static_cast<int>(recording.cloud.points->width);
  const int height = static_cast<int>(recording.cloud.points->height);
  std::vector<Disc> discs;
  for (int row = size.radius_px; row < height; row += size.radius_px)
    for (int column = size.radius_px; column < width; column += size.radius_px)
      if (Disc disc = discAt(recording, size, column, row); !disc.empty())
        discs.push_back(std::move(disc));
  const auto wanted = static_cast<std::size_t>(most);
  for (std::size_t i = 0; i < wanted && wanted < discs.size(); ++i)
    std::swap(discs[i], discs[i + generator() % (discs.size() - i)]);
  discs.resize(std::min(discs.size(), wanted));
  return discs;
}

// The fits.

/// One patch about the plane of the whole.
struct Outcome {
  bool usable = false;
  int points = 0;
  double nees = 0.0; ///< of height and tilts together
  double height_m = 0.0, height_variance = 0.0;
  double tilt_square = 0.0, tilt_variance = 0.0; ///< both tilts, rad^2
  double chi2 = 0.0, chi2_dof = 0.0, chi2_expected = 0.0;
  bool typed = false; ///< the surface `auto` has a patch, too
  bool curved = false; ///< and it is no plane
};

/// Height of the plane over the centre of the patch, and the rotation of the patch's
/// normal to the plane's about its own x and y axes, with their covariance.
void
compare(const FitResult& fit, const RecordedPlane& plane, Outcome& outcome)
{
  const Eigen::Matrix3d axes = expMap(fit.patch.r);
  Eigen::Vector3d normal = axes.transpose() * plane.normal;
  double offset = plane.offset_m;
  if (normal.z() < 0.0) {
    normal = -normal;
    offset = -offset;
  }
  // Along the patch's normal. Exp(delta) z = z + delta x z.
  const Eigen::Vector3d error((offset - (axes * normal).dot(fit.patch.c)) / normal.z(),
                              -normal.y(),
                              normal.x());
  const ParameterLayout layout = layoutOf(fit.patch.type);
  Eigen::Matrix<double, kErrors, Eigen::Dynamic> J;
  J.setZero(kErrors, layout.size());
  J.block<1, 3>(0, layout.c()) = axes.col(2).transpose();
  J.block<2, 2>(1, layout.r()).setIdentity();
  const Eigen::Matrix3d S = J * toTangent(fit.patch, fit.covariance) * J.transpose();
  outcome.nees = error.dot(S.ldlt().solve(error));
  outcome.height_m = error[0];
  outcome.height_variance = S(0, 0);
  outcome.tilt_square = error.tail<2>().squaredNorm();
  outcome.tilt_variance = S(1, 1) + S(2, 2);
}

/// Fits of discs with one sensor's noise. Refers to the recording.
class DiscFitter {
public:
  DiscFitter(const RecordedCloud& recording, const Sensor& sensor)
  : recording_(recording)
  , gatherer_(recording.cloud, sensor, planeOptions().noise_at_surface)
  , plane_(planeOptions())
  , auto_(FitOptions{})
  {}

  Outcome fit(const Disc& disc) const
  {
    Outcome outcome;
    const FitResult fit = estimate(plane_, disc);
    if (!isUsable(fit.status))
      return outcome;
    outcome.usable = true;
    outcome.points = fit.points;
    outcome.chi2 = fit.chi2;
    outcome.chi2_dof = fit.chi2_dof;
    outcome.chi2_expected = fit.chi2_expected;
    compare(fit, recording_.plane, outcome);
    const FitResult free = estimate(auto_, disc);
    outcome.typed = isUsable(free.status);
    outcome.curved = outcome.typed && free.patch.type.surface != SurfaceType::Plane;
    return outcome;
  }

private:
  static FitOptions planeOptions()
  {
    FitOptions options;
    options.surface = SurfaceRequest::Plane;
    return options;
  }

  FitResult estimate(const PatchEstimator& estimator, const Disc& disc) const
  {
    const auto middle = static_cast<std::size_t>(disc[disc.size() / 2]);
    PointBatch batch;
    gatherer_.gather(disc,
                     (*recording_.cloud.points)[middle].getVector3fMap().cast<double>(),
                     batch);
    return estimator.estimate(batch);
  }

  const RecordedCloud& recording_;
  PointGatherer gatherer_;
  PatchEstimator plane_;
  PatchEstimator auto_;
};

// The rows.

struct Tally {
  int patches = 0, failures = 0, typed = 0, curved = 0, within = 0;
  double points = 0.0, nees = 0.0, chi2 = 0.0, chi2_dof = 0.0, chi2_expected = 0.0;
  double height_squares = 0.0, height_variances = 0.0;
  double tilt_squares = 0.0, tilt_variances = 0.0;

  void add(const Outcome& outcome)
  {
    if (!outcome.usable) {
      ++failures;
      return;
    }
    ++patches;
    points += outcome.points;
    nees += outcome.nees;
    within += outcome.nees <= kChiSquare95 ? 1 : 0;
    chi2 += outcome.chi2;
    chi2_dof += outcome.chi2_dof;
    chi2_expected += outcome.chi2_expected;
    height_squares += outcome.height_m * outcome.height_m;
    height_variances += outcome.height_variance;
    tilt_squares += outcome.tilt_square;
    tilt_variances += outcome.tilt_variance;
    typed += outcome.typed ? 1 : 0;
    curved += outcome.curved ? 1 : 0;
  }
};

struct RowName {
  std::string recording;
  DiscSize size;
  bool pattern;
};

Json
rowOf(const RowName& name, const Tally& tally)
{
  const double n = tally.patches;
  const auto ratio = [](double a, double b) { return b > 0.0 ? Json(a / b) : Json(); };
  const auto rms = [](double squares, double count, double unit) {
    return count > 0.0 ? Json(unit * std::sqrt(squares / count)) : Json();
  };
  constexpr double kDegree = 180.0 / kPi;
  return {{"recording", name.recording},
          {"radius_px", name.size.radius_px},
          {"stride_px", name.size.stride_px},
          {"pattern", name.pattern ? "with" : "without"},
          {"patches", tally.patches},
          {"points", ratio(tally.points, n)},
          {"nees_per_dof", ratio(tally.nees, kErrors * n)},
          {"coverage95", ratio(tally.within, n)},
          {"chi2_per_dof", ratio(tally.chi2, tally.chi2_dof)},
          {"chi2_per_expected", ratio(tally.chi2, tally.chi2_expected)},
          {"height_rms_mm", rms(tally.height_squares, n, 1e3)},
          {"height_predicted_mm", rms(tally.height_variances, n, 1e3)},
          {"tilt_rms_deg", rms(tally.tilt_squares, n, kDegree)},
          {"tilt_predicted_deg", rms(tally.tilt_variances, n, kDegree)},
          {"curved_share", ratio(tally.curved, tally.typed)},
          {"untyped", tally.patches - tally.typed},
          {"failures", tally.failures}};
}

constexpr const char* kAllRecordings = "all";

using Tallies = std::array<std::array<Tally, 2>, kSizes.size()>; ///< [size][pattern]

void
addRows(const std::string& recording, const Tallies& tallies, std::vector<Json>& rows)
{
  for (std::size_t size = 0; size < kSizes.size(); ++size)
    for (std::size_t pattern = 0; pattern < 2; ++pattern)
      rows.push_back(
          rowOf({recording, kSizes[size], pattern == 1}, tallies[size][pattern]));
}

using Outcomes = std::array<Outcome, 2>; ///< without the pattern, with it

/// Of the discs of one size on one recording.
std::vector<Outcomes>
fitDiscs(const RecordedCloud& recording,
         std::size_t size,
         std::uint64_t stream,
         const ExperimentSettings& settings)
{
  const std::vector<Disc> discs = discsOn(recording,
                                          kSizes[size],
                                          settings.trials,
                                          trialGenerator(settings.seed, stream));
  const DiscFitter without(recording, withoutPattern(recording.sensor));
  const DiscFitter with(recording, recording.sensor);
  std::vector<Outcomes> outcomes(discs.size());
  parallelFor(static_cast<int>(discs.size()), settings.threads, [&](int i, int) {
    const auto k = static_cast<std::size_t>(i);
    outcomes[k] = {without.fit(discs[k]), with.fit(discs[k])};
  });
  return outcomes;
}

// The plot.

std::string
sizeName(int radius, int stride)
{
  return std::to_string(radius) + " px" +
         (stride == 1 ? "" : ", every " + std::to_string(stride) + "th");
}

/// Lines over all recordings, a dot for each.
Panel
panelOf(const std::vector<Json>& rows,
        const std::string& title,
        const std::string& label,
        const std::string& key,
        bool logarithmic)
{
  Panel panel;
  panel.title = title;
  panel.x.label = "radius of the discs, and which of their pixels";
  panel.y = {label, logarithmic};
  for (const DiscSize& size : kSizes)
    panel.x.categories.push_back(sizeName(size.radius_px, size.stride_px));
  for (const std::string pattern : {"without", "with"}) {
    const std::string name = pattern + " the pattern";
    Series all{name, {}, {}}, each{name, {}, {}, SeriesStyle::Markers};
    for (const Json& row : rows) {
      if (row["pattern"] != pattern || row[key].is_null())
        continue;
      Series& series = row["recording"] == kAllRecordings ? all : each;
      const auto& names = panel.x.categories;
      const auto at = std::find(names.begin(),
                                names.end(),
                                sizeName(row["radius_px"], row["stride_px"]));
      series.x.push_back(static_cast<double>(at - names.begin()));
      series.y.push_back(row[key]);
    }
    panel.series.push_back(all);
    panel.series.push_back(each);
  }
  return panel;
}

std::vector<Column>
columns()
{
  return {{"recording", "recording"},
          {"radius", "radius_px"},
          {"stride", "stride_px"},
          {"pattern", "pattern"},
          {"patches", "patches"},
          {"points", "points"},
          {"NEES/dof", "nees_per_dof"},
          {"in 95 %", "coverage95"},
          {"chi2/dof", "chi2_per_dof"},
          {"chi2/expected", "chi2_per_expected"},
          {"height (mm)", "height_rms_mm"},
          {"predicted", "height_predicted_mm"},
          {"tilt (deg)", "tilt_rms_deg"},
          {"predicted", "tilt_predicted_deg"},
          {"curved", "curved_share"},
          {"failures", "failures"}};
}

std::vector<std::string>
explanations()
{
  return {
      "Planes fitted to discs of pixels, about the plane of the whole on which they "
      "lie: NEES is of the height of the centre and the two tilts of the normal "
      "together, over 3; height and tilt are rms errors beside the predicted ones. "
      "Discs about a grid, each half over the next. Curved: share of the same "
      "discs that the surface `auto` calls something else than a plane, where 1 % "
      "are meant to be.",
      "Without the pattern, errors of neighbouring pixels count as independent. "
      "What the whole plane is bent or uneven counts as an error here."};
}

struct RealOptions {
  RecordingOptions recordings;
  bool leave_one_out = false;
};

Report
run(const ExperimentSettings& settings, const RealOptions& options)
{
  Report report;
  report.columns = columns();
  report.remarks = explanations();
  std::vector<RecordedCloud> recordings =
      loadRecordings(options.recordings, settings.seed, report.remarks);
  if (options.leave_one_out)
    usePatternsOfOtherPoses(recordings, report.remarks);
  else
    report.remarks.push_back("Pattern of the sensor: " +
                             patternText(recordings.front().sensor.pattern));
  const int total = static_cast<int>(recordings.size() * kSizes.size());
  Tallies all;
  int done = 0;
  for (const RecordedCloud& recording : recordings) {
    Tallies own;
    for (std::size_t size = 0; size < kSizes.size(); ++size) {
      const auto stream = static_cast<std::uint64_t>(done);
      for (const Outcomes& outcomes : fitDiscs(recording, size, stream, settings))
        for (std::size_t pattern = 0; pattern < 2; ++pattern) {
          own[size][pattern].add(outcomes[pattern]);
          all[size][pattern].add(outcomes[pattern]);
        }
      settings.progress(++done, total);
    }
    addRows(recording.name, own, report.rows);
  }
  addRows(kAllRecordings, all, report.rows);
  report.plot.columns = 2;
  report.plot.panels = {panelOf(report.rows,
                                "Errors of patches on recorded planes",
                                "NEES/dof (1 is right)",
                                "nees_per_dof",
                                true),
                        panelOf(report.rows,
                                "Flat discs called curved",
                                "share (0.01 is right)",
                                "curved_share",
                                false)};
  return report;
}

} // namespace

Experiment
realExperiment()
{
  return {"real",
          "Patches on recorded planes: are the covariances right on a real camera?",
          "At most so many discs of each size on each recording",
          1000,
          [](CLI::App& command) {
            const auto options = std::make_shared<RealOptions>();
            addRecordingOptions(command, options->recordings);
            command
                .add_flag("--leave-one-out",
                          options->leave_one_out,
                          "Estimate the pattern of each recording from those of other "
                          "poses, in place of the sensor's")
                ->group("Input");
            return ExperimentRun([options](const ExperimentSettings& settings) {
              return run(settings, *options);
            });
          }};
}

} // namespace holdfast::app
