#include "device_options.h"

#include "command_line.h"
#include "common_options.h"

#include <CLI/CLI.hpp>

#include <iostream>
#include <stdexcept>
#include <vector>

namespace holdfast::app {

namespace {

/// Ends the parsing, as --help does.
void
listDevices()
{
  const std::vector<Openni2DeviceInfo> devices = listOpenni2Devices();
  if (devices.empty())
    throw std::runtime_error("no camera found");
  for (std::size_t i = 0; i < devices.size(); ++i)
    std::cout << i + 1 << "  " << devices[i].vendor << ' ' << devices[i].name << "  "
              << devices[i].uri << '\n';
  throw CLI::Success();
}

} // namespace

void
addDeviceOptions(CLI::App& command, Openni2Options& options)
{
  const std::string group = "Camera";
  command
      .add_option("--device",
                  options.device,
                  "Camera: its number, from 1, or URI; or an .oni recording (default: "
                  "the first camera)")
      ->type_name("N|URI|FILE.oni")
      ->group(group);
  command
      .add_flag_callback("--list", listDevices, "List the cameras, and do nothing else")
      ->group(group);
  command
      .add_option_function<std::string>(
          "--size",
          [&options](const std::string& size) {
            options.width = size == "320x240" ? 320 : 640;
            options.height = size == "320x240" ? 240 : 480;
          },
          "Size of the depth images; a recording has its own")
      ->check(CLI::IsMember({"640x480", "320x240"}))
      ->type_name("")
      ->default_str("640x480")
      ->group(group);
  command
      .add_flag("--registration",
                options.registration,
                "Let the camera move its depth onto the pixels of its colour image")
      ->group(group);
  command
      .add_flag_callback(
          "--every-frame",
          [&options] { options.playback = Playback::EveryFrame; },
          "Play a recording frame by frame, as fast as the work is done, instead of at "
          "the speed it was recorded")
      ->group(group);
  command
      .add_flag_callback(
          "--no-reconnect",
          [&options] { options.reconnect = false; },
          "End when the camera fails, instead of waiting for its return")
      ->group(group);
}

void
addRunOptions(CLI::App& command, RunOptions& options)
{
  const std::string group = "Run";
  command
      .add_option("--frames",
                  options.frames,
                  "End after so many frames; default: never")
      ->check(CLI::Range(1, 2147483647, "N"))
      ->type_name("")
      ->group(group);
  command
      .add_option("--seconds", options.seconds, "End after this time; default: never")
      ->check(positiveNumber("S"))
      ->type_name("")
      ->group(group);
  addQuietOption(command, options.quiet);
}

} // namespace holdfast::app
