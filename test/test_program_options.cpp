// Options that several sub-commands have mean the same in all of them.
#include <holdfast/io/cloud_io.h>

#include "support/run_program.h"
#include "support/small_clouds.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <map>
#include <sstream>

namespace holdfast { namespace {

using test::freshFolder;
using test::ProgramRun;
using test::runProgram;
using Words = std::vector<std::string>;

const std::string kFolder = freshFolder("program_options");

std::string
helpOf(Words command)
{
  command.emplace_back("--help");
  const ProgramRun run = runProgram(kFolder, command);
  EXPECT_EQ(run.exit_code, 0) << run.err;
  return run.out;
}

/// Every command that has none below it, found in the help of those above.
std::vector<Words>
commandsBelow(const Words& command)
{
  std::istringstream help(helpOf(command));
  std::string line;
  while (std::getline(help, line) && line.rfind("Subcommands:", 0) != 0) {}
  std::vector<Words> commands;
  while (std::getline(help, line) && line.rfind("  ", 0) == 0) {
    if (line[2] == ' ')
      continue; // a description goes on
    Words below = command;
    below.push_back(line.substr(2, line.find_first_of(" ,", 2) - 2));
    for (const Words& found : commandsBelow(below))
      commands.push_back(found);
  }
  if (commands.empty())
    commands.push_back(command);
  return commands;
}

/// What the help says about an option, in one line; empty where there is none.
std::string
descriptionOf(const std::string& help, const std::string& option)
{
  std::istringstream lines(help);
  std::string line, text;
  bool inside = false;
  while (std::getline(lines, line)) {
    const bool begins = line.rfind("  -", 0) == 0;
    if (begins)
      inside = line.rfind("  " + option + " ", 0) == 0 ||
               line.rfind("  " + option + ",", 0) == 0;
    else if (line.rfind("    ", 0) != 0)
      inside = false;
    if (inside)
      text += line + ' ';
  }
  std::istringstream words(text);
  std::string word, joined;
  for (bool first = true; words >> word; first = false)
    if (!first) // not its own name
      joined += (joined.empty() ? "" : " ") + word;
  return joined;
}

std::string
joined(const Words& command)
{
  std::string text;
  for (const std::string& word : command)
    text += word + ' ';
  return text;
}

TEST(ProgramOptions, EveryCommandSaysTheSameAboutThem)
{
  const std::vector<Words> commands = commandsBelow({});
  ASSERT_GE(commands.size(), 11U);
  int with_threads = 0, with_json = 0;
  for (const Words& command : commands) {
    SCOPED_TRACE(joined(command));
    const std::string help = helpOf(command);
    EXPECT_EQ(descriptionOf(help, "--quiet"),
              "Errors only: no table, notices or progress");
    const std::string threads = descriptionOf(help, "--threads");
    with_threads += !threads.empty();
    if (!threads.empty()) {
      EXPECT_NE(
          threads.find("Threads to use, 0: all cores; results do not depend on it"),
          std::string::npos)
          << threads;
    }
    const std::string json = descriptionOf(help, "--json");
    with_json += !json.empty();
    if (!json.empty()) {
      EXPECT_NE(json.find("Write JSON to this file, or with - to standard output and "
                          "nothing else there"),
                std::string::npos)
          << json;
    }
  }
  EXPECT_GE(with_threads, 7); // fit and the experiments
  EXPECT_GE(with_json, 9); // these, info and calibrate
}

/// Commands that work on a small cloud, without --quiet and --json.
std::vector<Words>
workingCommands()
{
  const std::string cloud = kFolder + "/bowl.pcd", flat = kFolder + "/table.pcd";
  saveCloud(cloud, test::bowlCloud(96, 64));
  const Words simulation{"simulate", "table", "--quiet", "-o", flat};
  EXPECT_EQ(runProgram(kFolder, simulation).exit_code, 0);
  return {{"fit", cloud, "--whole"},
          {"info", cloud},
          {"calibrate", flat},
          {"experiment", "consistency", "--trials", "2", "--threads", "2"},
          {"experiment", "calibration", "--trials", "2", "--threads", "0"}};
}

TEST(ProgramOptions, QuietPrintsNothing)
{
  for (Words command : workingCommands()) {
    SCOPED_TRACE(joined(command));
    EXPECT_NE(runProgram(kFolder, command).out, "");
    command.emplace_back("--quiet");
    const ProgramRun run = runProgram(kFolder, command);
    EXPECT_EQ(run.exit_code, 0);
    EXPECT_EQ(run.out, "");
    EXPECT_EQ(run.err, "");
  }
}

TEST(ProgramOptions, JsonGoesWhereItIsWanted)
{
  using Json = nlohmann::json;
  for (const Words& command : workingCommands()) {
    SCOPED_TRACE(joined(command));
    const std::string table = runProgram(kFolder, command).out;
    Words printed = command, quiet = command, kept = command;
    printed.insert(printed.end(), {"--json", "-"});
    quiet.insert(quiet.end(), {"--json", "-", "--quiet"});
    kept.insert(kept.end(), {"--json", kFolder + "/result.json"});
    // Nothing but JSON, with or without --quiet; a file leaves the table where it was.
    EXPECT_TRUE(Json::accept(runProgram(kFolder, printed).out));
    EXPECT_TRUE(Json::accept(runProgram(kFolder, quiet).out));
    const ProgramRun run = runProgram(kFolder, kept);
    EXPECT_EQ(run.exit_code, 0) << run.err;
    EXPECT_EQ(std::count(run.out.begin(), run.out.end(), '\n'),
              std::count(table.begin(), table.end(), '\n'));
    EXPECT_TRUE(Json::accept(test::readFile(kFolder + "/result.json")));
  }
}

}} // namespace holdfast
