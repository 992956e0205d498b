// Contact risk: closed forms against draws, and predictions against what happens.
#include "experiment.h"
#include "input_options.h"
#include "risk_cases.h"
#include "spots.h"
#include "walk_options.h"

#include <holdfast/evaluation/contact_referee.h>
#include <holdfast/geometry/gaussian.h>
#include <holdfast/geometry/rotation.h>
#include <holdfast/uncertainty/monte_carlo.h>

#include <CLI/CLI.hpp>
#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>

namespace holdfast::app {
namespace {

struct RiskChoice {
  WalkChoice walk{{"boulder_field"}, 40};
  double radius_m = 0.08;
  double max_depth_change = PatchMapOptions().max_depth_change;
  int draws = 200000;
  int surfaces = 60;
};

/// A surface, foot and place whose risks are neither none nor certain.
struct DrawnCase {
  ContactSurface surface;
  Foot foot;
  Placement placement;
};

DrawnCase
drawCase(std::mt19937_64& generator)
{
  const auto uniform = [&](double low, double high) {
    return uniformBetween(low, high, generator);
  };
  DrawnCase c;
  c.surface.radius_m = 0.12;
  c.surface.support.mark(0.0, 0.0, 2.0 * SupportGrid::kReach);
  c.surface.anchor.R = expMap(normalVector(generator));
  JetVector sigma;
  const double slope = uniform(0.005, 0.15);
  sigma << uniform(0.001, 0.01), slope, slope * uniform(0.3, 1.0),
      Eigen::Vector3d::Constant(uniform(0.1, 2.0));
  std::normal_distribution<double> normal;
  const JetMatrix mix = JetMatrix::Identity() + 0.25 * JetMatrix::NullaryExpr([&] {
                                                  return normal(generator);
                                                });
  c.surface.jet.white = symmetrized(
      JetMatrix(sigma.asDiagonal() * mix * mix.transpose() * sigma.asDiagonal()));
  c.surface.jet.value << uniform(-0.01, 0.01), uniform(-0.3, 0.3), uniform(-0.3, 0.3),
      uniform(-3.0, 3.0), uniform(-1.0, 1.0), uniform(-3.0, 3.0);
  c.surface.s3_per_m2 = uniform(0.0, 60.0);
  c.foot = rectangularFoot(uniform(0.06, 0.2), uniform(0.04, 0.1));
  c.foot.curvature = {uniform(-1.0, 3.0), uniform(-1.0, 3.0)};
  c.foot.ankle = uniform(0.0, 1.0) < 0.5 ? Ankle::Stiff : Ankle::Compliant;
  c.foot.friction = {uniform(0.25, 0.6), uniform(0.0, 0.15)};
  c.foot.tolerances.height_m = uniform(0.005, 0.02);
  c.foot.tolerances.tilt_rad = uniform(0.02, 0.2);
  c.foot.tolerances.gap_m = uniform(0.001, 0.006);
  c.placement.point = c.surface.anchor.toWorld(
      {uniform(-0.03, 0.03), uniform(-0.03, 0.03), c.surface.jet.value[0]});
  c.placement.load_direction =
      -(c.surface.anchor.R *
        Eigen::Vector3d(uniform(-0.2, 0.2), uniform(-0.2, 0.2), 1.0));
  c.placement.yaw = uniform(-3.0, 3.0);
  return c;
}

/// Closed forms and draws of one case.
struct Compared {
  ContactEvents formula, draws;
};

constexpr std::array<std::pair<const char*, double ContactEvents::*>, 5> kEvents{
    {{"slip", &ContactEvents::slip},
     {"height", &ContactEvents::height},
     {"tilt", &ContactEvents::tilt},
     {"gap", &ContactEvents::gap},
     {"any (joint)", &ContactEvents::joint}}};

std::vector<std::optional<Compared>>
compareWithDraws(const RiskChoice& choice, const ExperimentSettings& settings)
{
  std::vector<std::optional<Compared>> compared(
      static_cast<std::size_t>(choice.surfaces));
  parallelFor(choice.surfaces, settings.threads, [&](int i, int) {
    std::mt19937_64 generator =
        trialGenerator(settings.seed, static_cast<std::uint64_t>(i));
    const DrawnCase c = drawCase(generator);
    const ContactRisk risk = contactRisk(c.surface, c.foot, c.placement);
    const auto draws =
        drawnContactEvents(c.surface, c.foot, c.placement, choice.draws, generator);
    if (risk.quality && draws)
      compared[static_cast<std::size_t>(i)] = Compared{risk.quality->risk, *draws};
  });
  return compared;
}

/// Everything a row may have, in the order of the files.
Json
emptyRow(const std::string& of)
{
  Json row{{"of", of}};
  for (const char* key : {"scene",
                          "noise",
                          "views",
                          "bin",
                          "cases",
                          "predicted",
                          "happened",
                          "standard_error",
                          "predicted_total",
                          "largest_difference",
                          "rms_difference",
                          "total_over_any"})
    row[key] = Json();
  return row;
}

void
addClosedForms(const RiskChoice& choice,
               const ExperimentSettings& settings,
               Report& report)
{
  const auto compared = compareWithDraws(choice, settings);
  Mean ratio;
  for (const auto& [name, event] : kEvents) {
    Json row = emptyRow(fmt::format("closed form: {}", name));
    double largest = 0.0;
    Mean squares;
    for (const auto& c : compared) {
      if (!c)
        continue;
      const double difference = c->formula.*event - c->draws.*event;
      largest = std::max(largest, std::abs(difference));
      squares.add(difference * difference);
    }
    row["cases"] = squares.count();
    row["largest_difference"] = largest;
    row["rms_difference"] = squares.root();
    report.rows.push_back(row);
    report.summary.push_back(row);
  }
  for (const auto& c : compared)
    if (c && c->draws.joint > 1e-3 && c->draws.joint < 0.3)
      ratio.add(c->formula.total / c->draws.joint);
  Json row = emptyRow("union bound over any, where that is 0.001 to 0.3");
  row["cases"] = ratio.count();
  row["total_over_any"] = ratio.value();
  report.rows.push_back(row);
  report.summary.push_back(row);
}

/// Predictions of like size and how often what they speak of happened.
class Reliability {
public:
  /// \param p predicted probability of what is_so says of the case
  void add(double p, bool is_so, const RiskCase& c)
  {
    predicted_.add(p);
    total_.add(c.predicted.total);
    happened_.add(is_so ? 1.0 : 0.0);
    Walk& walk = walks_[c.walk];
    ++walk.cases;
    walk.excess += (is_so ? 1.0 : 0.0) - p;
  }
  void addTo(Json& row) const
  {
    row["cases"] = predicted_.count();
    row["predicted"] = predicted_.value();
    row["predicted_total"] = total_.value();
    row["happened"] = happened_.value();
    row["standard_error"] = standardError();
  }

private:
  struct Walk {
    int cases = 0;
    double excess = 0.0; ///< of what happened over what was predicted
  };

  /// Of happened less predicted, by how much that differs between walks: within one,
  /// places are looked at again and again and share errors of pose and pattern. Null
  /// with one walk.
  Json standardError() const
  {
    const auto walks = static_cast<double>(walks_.size());
    if (walks < 2.0)
      return {};
    double cases = 0.0, excess = 0.0, squares = 0.0;
    for (const auto& [seed, walk] : walks_) {
      cases += walk.cases;
      excess += walk.excess;
    }
    for (const auto& [seed, walk] : walks_) {
      const double off = walk.excess - excess / cases * walk.cases;
      squares += off * off;
    }
    return std::sqrt(squares * walks / (walks - 1.0)) / cases;
  }

  Mean predicted_, total_, happened_;
  std::map<std::uint64_t, Walk> walks_;
};

struct Group {
  std::string scene, noise, views;
};

Json
rowOf(const std::string& of, const Group& group)
{
  Json row = emptyRow(of);
  row["scene"] = group.scene;
  row["noise"] = group.noise;
  row["views"] = group.views;
  return row;
}

constexpr int kBins = 10;

void
addBins(const Group& group, const std::vector<RiskCase>& cases, Report& report)
{
  std::array<Reliability, kBins> bins;
  for (const RiskCase& c : cases) {
    const double p = probabilityOfAny(c.predicted);
    const int bin = std::clamp(static_cast<int>(kBins * p), 0, kBins - 1);
    bins[static_cast<std::size_t>(bin)].add(p, c.failed(), c);
  }
  Series series{fmt::format("{}, {}", group.noise, group.views), {}, {}};
  series.style = SeriesStyle::Line;
  for (int i = 0; i < kBins; ++i) {
    Json row = rowOf("any", group);
    row["bin"] = fmt::format("{:.1f} to {:.1f}", 0.1 * i, 0.1 * (i + 1));
    bins[static_cast<std::size_t>(i)].addTo(row);
    if (!row["predicted"].is_null()) {
      series.x.push_back(row["predicted"]);
      series.y.push_back(row["happened"]);
    }
    report.rows.push_back(row);
    report.summary.push_back(row);
  }
  report.plot.panels.front().series.push_back(series);
}

/// The events one by one: which of them is off, if one is.
void
addEvents(const Group& group, const std::vector<RiskCase>& cases, Report& report)
{
  Reliability slip, height, gap;
  for (const RiskCase& c : cases) {
    slip.add(c.predicted.slip, c.slipped, c);
    height.add(c.predicted.height, c.was_off_height, c);
    gap.add(c.predicted.gap, c.gaped, c);
  }
  for (const auto& [name, reliability] : {std::pair("slip", &slip),
                                          std::pair("height", &height),
                                          std::pair("gap", &gap)}) {
    Json row = rowOf(name, group);
    reliability->addTo(row);
    report.rows.push_back(row);
    report.summary.push_back(row);
  }
}

void
addChosen(const Group& group, const std::vector<ChosenCase>& chosen, Report& report)
{
  Reliability first, again;
  for (const ChosenCase& c : chosen) {
    const bool failed = c.chosen.failed();
    first.add(probabilityOfAny(c.chosen.predicted), failed, c.chosen);
    again.add(c.judged_again, failed, c.chosen);
  }
  for (const auto& [name, reliability] :
       {std::pair("best of 20, as chosen", &first),
        std::pair("best of 20, judged by another view", &again)}) {
    Json row = rowOf(name, group);
    reliability->addTo(row);
    report.rows.push_back(row);
    report.summary.push_back(row);
  }
}

void
addWalks(const RiskChoice& choice, const ExperimentSettings& settings, Report& report)
{
  const int stages = 2 * static_cast<int>(choice.walk.scenes.size()) * settings.trials;
  int stage = 0;
  for (const std::string& scene : choice.walk.scenes)
    for (const bool pattern : {false, true}) {
      RiskOutcome all;
      for (int trial = 0; trial < settings.trials; ++trial) {
        RiskWalk walk;
        walk.scene = scene;
        walk.radius_m = choice.radius_m;
        walk.max_depth_change = choice.max_depth_change;
        walk.frames = choice.walk.frames;
        walk.step_m = choice.walk.step_m;
        walk.stride = choice.walk.stride;
        walk.pattern = pattern;
        walk.sensor = loadSensorOption(choice.walk.sensor);
        walk.seed = settings.seed + static_cast<std::uint64_t>(trial);
        walk.threads = settings.threads;
        walk.progress = stageProgress(settings.progress, stage++, stages);
        RiskOutcome one = riskWalk(walk);
        all.single.insert(all.single.end(), one.single.begin(), one.single.end());
        all.fused.insert(all.fused.end(), one.fused.begin(), one.fused.end());
        all.chosen.insert(all.chosen.end(), one.chosen.begin(), one.chosen.end());
      }
      const std::string noise = pattern ? "pattern" : "independent";
      for (const auto& [views, cases] :
           {std::pair("single", &all.single), std::pair("fused", &all.fused)}) {
        addBins({scene, noise, views}, *cases, report);
        addEvents({scene, noise, views}, *cases, report);
      }
      addChosen({scene, noise, "single"}, all.chosen, report);
    }
}

void
describe(const RiskChoice& choice, Report& report)
{
  report.columns = {{"of", "of"},
                    {"scene", "scene"},
                    {"noise", "noise"},
                    {"views", "views"},
                    {"bin", "bin"},
                    {"cases", "cases"},
                    {"predicted", "predicted"},
                    {"happened", "happened"},
                    {"+-", "standard_error"},
                    {"union", "predicted_total"},
                    {"largest diff.", "largest_difference"},
                    {"rms diff.", "rms_difference"},
                    {"union/any", "total_over_any"}};
  report.remarks = {
      fmt::format("Closed forms against {} draws of {} random surfaces under random "
                  "feet: an event's probability by contactRisk() less how often it "
                  "happens.",
                  choice.draws,
                  choice.surfaces),
      fmt::format(
          "Then a camera walks {:.3g} m, 1.2 m above the ground, with odometry of 1 "
          "mrad and 2 mm a frame and axis, and random feet with random tolerances "
          "stand on random places of patches of {:.3g} cm radius, seen in the last "
          "frame alone (single) or in all so far (fused): predicted is the mean of the "
          "joint probability that the foot slips, is off its height or gapes; happened "
          "is how often the true surface under the sole does that; +- is the standard "
          "error of their difference, from how much it differs between walks, each "
          "with "
          "noise, odometry and pattern of its own; union: the mean of the sum over all "
          "events, what was not seen under the sole among them.",
          choice.walk.step_m * (choice.walk.frames - 1),
          100.0 * choice.radius_m),
      "Best of 20: of 20 random places for one foot the one with the least total risk, "
      "as it was chosen, and as another view, which had no part in the choice, judges "
      "it."};
}

Report
runRisk(const RiskChoice& choice, const ExperimentSettings& settings)
{
  Report report;
  Panel panel;
  panel.title = "predicted and true risk";
  panel.x.label = "predicted probability of any event";
  panel.y.label = "how often one happened";
  panel.equal_scales = true;
  panel.series.push_back({"as it should be", {0.0, 1.0}, {0.0, 1.0}});
  panel.series.back().style = SeriesStyle::DashedLine;
  report.plot.panels.push_back(panel);
  addClosedForms(choice, settings, report);
  addWalks(choice, settings, report);
  describe(choice, report);
  return report;
}

void
addChoices(CLI::App& command, RiskChoice& choice)
{
  addWalkOptions(command, choice.walk);
  command.add_option("--radius", choice.radius_m, "Of the patches, m")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  command
      .add_option(
          "--max-depth-change",
          choice.max_depth_change,
          "Of a spot, as a share, beyond which the map takes the pattern as new")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  command.add_option("--draws", choice.draws, "Of a surface, for its closed forms")
      ->check(CLI::Range(100, 100000000, "N"))
      ->type_name("")
      ->capture_default_str();
  command.add_option("--surfaces", choice.surfaces, "Random surfaces that are drawn")
      ->check(CLI::Range(1, 1000000, "N"))
      ->type_name("")
      ->capture_default_str();
}

} // namespace

Experiment
riskExperiment()
{
  Experiment experiment;
  experiment.name = "risk";
  experiment.summary = "Contact risk against draws, and against what happens";
  experiment.trials_meaning = "walks through each scene, whose noise differs";
  experiment.default_trials = 2;
  experiment.fewest_trials = 1;
  experiment.prepare = [](CLI::App& command) -> ExperimentRun {
    const auto choice = std::make_shared<RiskChoice>();
    addChoices(command, *choice);
    return [choice](const ExperimentSettings& settings) {
      return runRisk(*choice, settings);
    };
  };
  return experiment;
}

} // namespace holdfast::app
