#include "commands.h"
#include "commit.h"
#include "console.h"
#include "endings.h"

#include <CLI/CLI.hpp>

#include <cstddef>
#include <iostream>
#include <new>
#include <string>

namespace {

#ifdef HOLDFAST_QUICKSTART
constexpr const char* kExamples = R"(Examples:
  holdfast info rocks.pcd                   what is in a cloud
  holdfast fit rocks.pcd                    patches all over it, as a table
  holdfast fit rocks.pcd -o results         and as JSON and a coloured mesh

This program was built by samples/quickstart.sh, which leaves out all commands but
these two. From the folder of the project,
  cmake -S . -B build && cmake --build build
builds the others as well: live, record, map, risk, render, report, collect, calibrate,
simulate, experiment.
'holdfast COMMAND --help' explains a command.
Exit codes: 0 all done, 1 something failed, 2 wrong usage; others: fit --manifest.
)";
#else
constexpr const char* kExamples = R"(Examples:
  holdfast simulate rocks -o rocks.pcd      a cloud of a simulated scene
  holdfast info rocks.pcd                   what is in a cloud
  holdfast fit rocks.pcd                    patches all over it, as a table
  holdfast fit rocks.pcd -o results         and as JSON and a coloured mesh
  holdfast live                             patches of a depth camera, as they come
  holdfast render results/rocks.patches.json -o rocks.png
                                            and as a picture
  holdfast report results/rocks.patches.json -o rocks.html
                                            and as a page to look around in
  holdfast fit can.pcd --whole --surface cylinder --json -
                                            one patch to all points, as JSON
  holdfast map frames/ --poses trajectory.txt -o map.json
                                            patches of a moving camera, fused
  holdfast risk rocks.pcd --foot point_foot where may a foot step, and what if?
  holdfast collect results/ -o dataset.h5   patches of a data set as columns (HDF5)
  holdfast calibrate frames/ -o mine.yaml   how large is my camera's noise?
  holdfast experiment table1                are the covariances right?

'holdfast COMMAND --help' explains a command.
Exit codes: 0 all done, 1 something failed, 2 wrong usage; others: fit --manifest.
)";
#endif

/// Standard output may be a full disk.
int
flushed(int exit_code)
{
  if (std::cout.flush())
    return exit_code;
  holdfast::app::printError("standard output cannot be written");
  return 1;
}

/// Engines that run clouds in thousands take 2 for a task that is done but for some of
/// them (fit/fit_settings.h).
int
wrongUsage(const CLI::App& app)
{
  const CLI::App* fit = app.get_subcommand("fit");
  return fit->count("--manifest") > 0 ? 1 : 2;
}

constexpr std::size_t kStackBytes = 256 * 1024;

[[gnu::noinline]] void
touchStack()
{
  constexpr std::size_t kPage = 4096;
  [[maybe_unused]] volatile char stack[kStackBytes];
  for (std::size_t i = 0; i < kStackBytes; i += kPage)
    stack[i] = 0;
}

/// A stack that cannot grow ends the process without a word. Under a limit of memory it
/// therefore grows at once, while somebody can still be told: further than the sums of
/// a fit let it, whose frames are the largest.
void
growStack()
{
  // Throws where there is not as much.
  ::operator delete(::operator new(2 * kStackBytes));
  touchStack();
}

int
run(int argc, char** argv)
{
  CLI::App app("Holdfast: bounded curved contact patches with their covariance, from "
               "depth clouds.");
  app.footer(kExamples);
  app.set_version_flag("--version", "holdfast " + holdfast::app::versionWithCommit());
  app.require_subcommand(1);
  int exit_code = 0;
  holdfast::app::addFitCommand(app, exit_code);
  holdfast::app::addInfoCommand(app, exit_code);
#ifdef HOLDFAST_HAVE_OPENNI2
  holdfast::app::addLiveCommand(app, exit_code);
  holdfast::app::addRecordCommand(app, exit_code);
#endif
#ifndef HOLDFAST_QUICKSTART
  holdfast::app::addMapCommand(app, exit_code);
  holdfast::app::addRiskCommand(app, exit_code);
  holdfast::app::addRenderCommand(app, exit_code);
  holdfast::app::addReportCommand(app, exit_code);
  holdfast::app::addCalibrateCommand(app, exit_code);
  holdfast::app::addCollectCommand(app, exit_code);
  holdfast::app::addSimulateCommand(app, exit_code);
#endif
#ifdef HOLDFAST_HAVE_EXPERIMENTS
  holdfast::app::addExperimentCommand(app, exit_code);
#endif
  try {
    app.parse(argc, argv);
    return flushed(exit_code);
  }
  catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) // --help and --version
      return flushed(app.exit(error));
    const std::string message = error.what();
    holdfast::app::printError(message.substr(0, message.find('\n')));
    return wrongUsage(app);
  }
}

} // namespace

int
main(int argc, char** argv)
{
  holdfast::app::prepareForTheEnd();
  try {
    growStack();
    return run(argc, argv);
  }
  catch (...) {
    holdfast::app::printCurrentError();
    return 1;
  }
}
