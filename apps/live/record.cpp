#include "command_line.h"
#include "commands.h"
#include "console.h"
#include "device_options.h"
#include "grabber_run.h"
#include "live_statistics.h"
#include "recording.h"

#include <CLI/CLI.hpp>

#include <iostream>
#include <memory>
#include <string>

namespace holdfast::app {
namespace {

constexpr const char* kRecordExamples = R"(Examples:
  holdfast record -o walk.oni
      what the first camera delivers, until Ctrl-C
  holdfast record -o walk.oni --seconds 20 --device 2
      20 seconds of the second camera
  holdfast record -o frames --frames 100
      100 frames as frames/frame_000001.pcd and so on, for 'holdfast calibrate' or 'fit'
  holdfast record -o frames --device walk.oni --every-frame
      an .oni recording as PCD files

An .oni file keeps depth and colour as they came; a PCD per frame takes 3.7 MB at
640x480, 110 MB a second. What was written stays readable, whatever happens.
'holdfast live --record' fits patches meanwhile.
)";

struct RecordSettings {
  Openni2Options device;
  std::string output;
  RunOptions run;
};

int
runRecord(RecordSettings& settings)
{
  settings.run.records_oni = isOniPath(settings.output);
  settings.device.color = settings.run.records_oni;
  // Nothing can be added to an .oni file that the camera's failure has ended.
  settings.device.reconnect = settings.device.reconnect && !settings.run.records_oni;
  settings.run.reconnects = settings.device.reconnect;
  Openni2Grabber grabber(settings.device);
  Recording recording(grabber, settings.output, settings.device.playback);
  LiveStatistics statistics;
  // What the grabber drops is in an .oni file all the same.
  const auto dropped = [&] {
    const std::uint64_t by_grabber =
        settings.run.records_oni ? 0 : grabber.statistics().dropped;
    return std::to_string(recording.dropped() + by_grabber) + " dropped";
  };
  RunCallbacks callbacks;
  callbacks.frame = [&](const RangeFrame::ConstPtr& frame) {
    recording.push(frame);
    statistics.addFrame(frame->received);
  };
  callbacks.status = [&] { return statistics.pace() + ", " + dropped(); };
  callbacks.idle = [&recording] {
    recording.checkDisk();
    return true;
  };
  const int exit_code = runGrabber(grabber, settings.run, callbacks);
  recording.finish();
  if (!settings.run.quiet)
    std::cout << settings.output << ": " << statistics.overallPace() << ", "
              << dropped() << '\n';
  return exit_code;
}

} // namespace

void
addRecordCommand(CLI::App& app, int& exit_code)
{
  CLI::App* command =
      app.add_subcommand("record", "Record a depth camera to .oni or PCD files");
  command->footer(kRecordExamples);
  const auto settings = std::make_shared<RecordSettings>();
  addDeviceOptions(*command, settings->device);
  addRunOptions(*command, settings->run);
  command
      ->add_option("-o,--output",
                   settings->output,
                   "Recording to write: an .oni file, or a folder for a PCD per frame")
      ->required()
      ->type_name("FILE.oni|DIR")
      ->group("Output");
  tidyHelp(*command);
  command->callback([settings, &exit_code] { exit_code = runRecord(*settings); });
}

} // namespace holdfast::app
