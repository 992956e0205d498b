/// \file What the tests of sub-commands that show results share.
#pragma once

#include <holdfast/io/cloud_io.h>

#include "support/run_program.h"
#include "support/small_clouds.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace holdfast::test {

/// A sub-command that makes one file of results, and a folder for each test.
class ResultProgram : public testing::Test {
protected:
  ResultProgram(std::string command, const std::string& output_name)
  : command_(std::move(command))
  , folder_(freshFolder(command_ + "_" +
                        testing::UnitTest::GetInstance()->current_test_info()->name()))
  , output_(folder_ + "/" + output_name)
  {}

  /// Runs the sub-command. \return what it said on standard error.
  std::string runWell(std::vector<std::string> arguments) const
  {
    arguments.insert(arguments.begin(), command_);
    const ProgramRun run = runProgram(folder_, arguments);
    EXPECT_EQ(run.exit_code, 0) << run.err;
    EXPECT_EQ(run.out, "");
    return run.err;
  }

  /// Fits a bowl whose cloud lies beside its result and is named without a folder.
  /// \return the result file.
  std::string fitBowl(const std::string& name) const
  {
    const std::string cloud = folder_ + "/" + name + ".pcd";
    saveCloud(cloud, bowlCloud(40, 30, tiltedPose(), true));
    const ProgramRun run =
        runProgram(folder_, {"fit", cloud, "-o", folder_, "--quiet"});
    EXPECT_EQ(run.exit_code, 0) << run.err;
    const std::string result = folder_ + "/" + name + ".patches.json";
    nlohmann::json json = nlohmann::json::parse(readFile(result));
    json["cloud"] = name + ".pcd";
    writeFile(result, json.dump());
    return result;
  }

  /// Expects this exit code, one line that says `what`, and no output.
  void expectError(int exit_code,
                   std::vector<std::string> arguments,
                   const std::string& what) const
  {
    arguments.insert(arguments.begin(), command_);
    arguments.insert(arguments.end(), {"-o", output_});
    const ProgramRun run = runProgram(folder_, arguments);
    EXPECT_EQ(run.exit_code, exit_code) << what << '\n' << run.err;
    EXPECT_EQ(run.errorLines(), 1) << run.err;
    EXPECT_NE(run.err.find(what), std::string::npos) << run.err;
    EXPECT_FALSE(std::filesystem::exists(output_)) << what;
  }

  std::string command_;
  std::string folder_;
  std::string output_;
};

} // namespace holdfast::test
