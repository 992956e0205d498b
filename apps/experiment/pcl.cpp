// The experiment `pcl`, whose work is done by a module (comparison/): PCL's features
// and sample consensus take longer to load than the whole program without them.
#include "experiment.h"
#include "module.h"

#include "comparison/pcl_comparison.h"

namespace holdfast::app {
namespace {

Report
run(const ExperimentSettings& settings)
{
  const auto compare = reinterpret_cast<decltype(&holdfastCompareWithPcl)>(
      loadModuleFunction("holdfast_comparison", "holdfastCompareWithPcl"));
  Report report;
  compare(settings, report);
  return report;
}

} // namespace

Experiment
pclExperiment()
{
  return {"pcl",
          "Planes, spheres and cylinders by our models and by PCL's",
          "Noisy clouds of each surface",
          1000,
          [](CLI::App&) { return ExperimentRun(run); }};
}

} // namespace holdfast::app
