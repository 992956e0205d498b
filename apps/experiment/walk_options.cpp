#include "walk_options.h"

#include "input_options.h"

#include <holdfast/simulation/scene.h>

#include <CLI/CLI.hpp>

namespace holdfast::app {

void
addWalkOptions(CLI::App& command, WalkChoice& choice)
{
  command.add_option("--scene", choice.scenes, "Scenes to walk through")
      ->type_name("NAME...")
      ->check(CLI::IsMember(sceneNames()))
      ->capture_default_str();
  command.add_option("--frames", choice.frames, "Frames of a walk")
      ->check(CLI::Range(2, 100000, "N"))
      ->type_name("")
      ->capture_default_str();
  command.add_option("--step", choice.step_m, "Way between frames, m")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  command.add_option("--stride", choice.stride, "Every so many pixels count")
      ->check(CLI::Range(1, 16, "N"))
      ->type_name("")
      ->capture_default_str();
  addSensorOption(command, choice.sensor);
}

} // namespace holdfast::app
