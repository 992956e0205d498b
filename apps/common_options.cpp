#include "common_options.h"

#include <holdfast/io/cloud_io.h>

#include <CLI/CLI.hpp>

#include <filesystem>
#include <stdexcept>

namespace holdfast::app {

CLI::Option*
addQuietOption(CLI::App& command, bool& quiet)
{
  return command
      .add_flag("--quiet", quiet, "Errors only: no table, notices or progress")
      ->group("Output");
}

CLI::Option*
addThreadsOption(CLI::App& command, int& threads)
{
  return command
      .add_option("--threads",
                  threads,
                  "Threads to use, 0: all cores; results do not depend on it")
      ->check(CLI::Range(0, 4096, "N"))
      ->type_name("")
      ->capture_default_str()
      ->group("Run");
}

CLI::Option*
addJsonOption(CLI::App& command,
              std::string& path,
              const std::string& layout,
              const std::string& former_name)
{
  return command
      .add_option("--json" + (former_name.empty() ? "" : "," + former_name),
                  path,
                  "Write JSON to this file, or with - to standard output and nothing "
                  "else there" +
                      (layout.empty() ? "" : "; " + layout))
      // As in 'info --json *.pcd', where it takes the first cloud for its FILE.
      ->check([](const std::string& file) {
        return isCloudFile(file) ?
                   file + " is named as a cloud: JSON would replace it" :
                   std::string();
      })
      ->type_name("FILE")
      ->group("Output");
}

void
requireNoInput(const std::string& output, const std::vector<std::string>& inputs)
{
  std::error_code none_there;
  for (const std::string& input : inputs)
    if (std::filesystem::equivalent(output, input, none_there))
      throw std::runtime_error(output + ": would replace what it is made from");
}

} // namespace holdfast::app
