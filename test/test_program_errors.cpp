#include <holdfast/io/cloud_io.h>

#include "support/own_covariances.h"
#include "support/run_program.h"
#include "support/small_clouds.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <cmath>
#include <functional>
#include <limits>

namespace holdfast { namespace {

using test::freshFolder;
using test::ProgramRun;
using test::runProgram;

class ProgramErrors : public testing::Test {
protected:
  void SetUp() override
  {
    const std::string name =
        testing::UnitTest::GetInstance()->current_test_info()->name();
    folder_ = freshFolder("errors_" + name);
    good_ = folder_ + "/good.pcd";
    saveCloud(good_, test::bowlCloud(40, 30, {}, true));
  }

  /// Runs `fit` and expects this exit code and one line about it.
  ProgramRun expectError(int exit_code,
                         std::vector<std::string> arguments,
                         const std::string& what)
  {
    arguments.insert(arguments.begin(), "fit");
    const ProgramRun run = runProgram(folder_, arguments);
    std::string line;
    for (const std::string& argument : arguments)
      line += argument + ' ';
    SCOPED_TRACE(line + "\n" + run.err);
    EXPECT_EQ(run.exit_code, exit_code);
    EXPECT_EQ(run.err.rfind("holdfast: ", 0), 0U);
    EXPECT_EQ(run.errorLines(), 1);
    EXPECT_NE(run.err.find(what), std::string::npos);
    return run;
  }

  std::string write(const std::string& name, const std::string& bytes)
  {
    test::writeFile(folder_ + "/" + name, bytes);
    return folder_ + "/" + name;
  }

  std::string saveWith(const std::string& name,
                       const std::function<void(RangeCloud&)>& change)
  {
    RangeCloud cloud = test::bowlCloud(40, 30, {}, true);
    change(cloud);
    saveCloud(folder_ + "/" + name, cloud);
    return folder_ + "/" + name;
  }

  std::string folder_;
  std::string good_;
};

TEST_F(ProgramErrors, UsageErrorsExitWithTwo)
{
  const std::vector<std::vector<std::string>> cases{
      {},
      {good_, "--no-such-option"},
      {good_, "--surface", "torus"},
      {good_, "--boundary", "hexagon"},
      {good_, "--neighborhood", "cube"},
      {good_, "--seed-strategy", "hope"},
      {good_, "--covariance", "guess"},
      {good_, "--sensor", "no_such_sensor"},
      {good_, "--radius", "0"},
      {good_, "--radius", "-0.05"},
      {good_, "--radius", "nan"},
      {good_, "--radius", "inf"},
      {good_, "--radius", "5cm"},
      {good_, "--spacing", "0"},
      {good_, "--seeds", "0"},
      {good_, "--seeds", "2.5"},
      {good_, "--max-patches", "0"},
      {good_, "--max-area", "0"},
      {good_, "--max-time", "-1"},
      {good_, "--threads", "-1"},
      {good_, "--containment", "0"},
      {good_, "--containment", "1"},
      {good_, "--containment", "nan"},
      {good_, "--curvature-tolerance", "-1"},
      {good_, "--curvature-tolerance", "nan"},
      {good_, "--depth-scale", "0"},
      {good_, "--random-seed", "-3"},
      {good_, "--k", "50"},
      {good_, "--neighborhood", "knn", "--k", "0"},
      {good_, "--neighborhood", "knn", "--radius", "0.1"},
      {good_, "--surface", "sphere", "--boundary", "circle"},
      {good_, "--paper", "--residual", "ray"},
      {good_, "--whole", "--radius", "0.1"},
      {good_, "--whole", "--seeds", "3"},
      {good_, "--whole", "--spacing", "0.1"},
      {good_, "--whole", "--max-area", "1"},
      {good_, "--whole", "--neighborhood", "ball"},
      {good_, "--whole", "--seed-strategy", "random"}};
  for (auto arguments : cases) {
    const ProgramRun run = expectError(2, arguments, "");
    EXPECT_EQ(run.out, "");
  }
}

TEST_F(ProgramErrors, NoCommandOrAWrongOne)
{
  EXPECT_EQ(runProgram(folder_, {}).exit_code, 2);
  EXPECT_EQ(runProgram(folder_, {"fly"}).exit_code, 2);
  EXPECT_EQ(runProgram(folder_, {"info"}).exit_code, 2);
}

TEST_F(ProgramErrors, HelpTeaches)
{
  for (const std::vector<std::string>& arguments :
       {std::vector<std::string>{"--help"}, {"fit", "--help"}, {"info", "--help"}}) {
    const ProgramRun run = runProgram(folder_, arguments);
    EXPECT_EQ(run.exit_code, 0);
    EXPECT_EQ(run.err, "");
    EXPECT_NE(run.out.find("Examples:"), std::string::npos);
  }
  EXPECT_EQ(runProgram(folder_, {"--version"}).out.rfind("holdfast ", 0), 0U);
}

TEST_F(ProgramErrors, BadFilesAreNamedAndLeaveNoOutput)
{
  const std::string out = folder_ + "/out";
  const std::string json = folder_ + "/out.json";
  const std::string bytes = test::readFile(good_);
  const std::vector<std::pair<std::string, std::string>> cases{
      {folder_ + "/missing.pcd", "missing.pcd: no such file"},
      {write("empty.pcd", ""), "empty.pcd: is empty"},
      {write("cut.pcd", bytes.substr(0, bytes.size() / 2)), "cut.pcd: truncated"},
      {write("header.pcd", bytes.substr(0, 50)), "header.pcd: truncated"},
      {write("text.ply", "hello"), "text.ply: corrupt"},
      {write("nan.pcd",
             test::pcdHeader(test::kXyzFields, 1, 1, "ascii") + "nan nan nan\n"),
       "nan.pcd: has no valid point"},
      {write("one.pcd", test::pcdHeader(test::kXyzFields, 1, 1, "ascii") + "0 0 1\n"),
       "one.pcd: no patch: too_few_points"},
      {write("none.xyz", "1 2 3"), "none.xyz: is neither PCD"}};
  for (const auto& [path, what] : cases) {
    expectError(1, {path, "-o", out, "--json", json, "--quiet"}, what);
    EXPECT_FALSE(std::filesystem::exists(out)) << path;
    EXPECT_FALSE(std::filesystem::exists(json)) << path;
  }
  std::filesystem::create_directory(folder_ + "/hollow");
  expectError(1, {folder_ + "/hollow"}, "hollow: holds no cloud");
}

TEST_F(ProgramErrors, ABadFileDoesNotStopTheOthers)
{
  write("bad.pcd", "# .PCD v0.7\n");
  const std::string out = folder_ + "/out";
  expectError(1, {folder_, "-o", out, "--quiet"}, "bad.pcd: ");
  EXPECT_EQ(test::filesIn(out),
            (std::vector<std::string>{"good.patches.json",
                                      "good.patches.pcd",
                                      "good.patches.ply"}));
}

TEST_F(ProgramErrors, ResultsNeverReplaceThoseOfAnotherCloud)
{
  const std::string twin = write("good.ply", "");
  test::writeFile(twin, test::plyBytes<float>(test::bowlCloud(40, 30), "ascii"));
  expectError(1, {folder_, "-o", folder_ + "/out", "--quiet"}, "would replace");
}

TEST_F(ProgramErrors, BadCovariancesAreCountedAndLeftOut)
{
  const std::string some = saveWith("some.pcd", [](RangeCloud& cloud) {
    Covariances& covariances = test::ownCovariances(cloud);
    covariances[100].setConstant(std::nanf(""));
    covariances[200] *= -1.0F;
    covariances[300](0, 2) = covariances[300](2, 0) = 1.0F;
  });
  const std::string out = folder_ + "/out";
  expectError(1, {some, "-o", out, "--quiet", "--whole"}, "3 of 1199 covariances");
  ASSERT_EQ(test::filesIn(out).size(), 3U);
  const auto json = nlohmann::json::parse(test::readFile(out + "/some.patches.json"));
  EXPECT_EQ(json["patches"][0]["points"], 1199 - 3);

  const std::string all = saveWith("all.pcd", [](RangeCloud& cloud) {
    for (Eigen::Matrix3f& covariance : test::ownCovariances(cloud))
      covariance *= -1.0F;
  });
  expectError(1, {all, "-o", folder_ + "/none", "--quiet"}, "1199 of 1199 covariances");
  EXPECT_FALSE(std::filesystem::exists(folder_ + "/none"));
}

TEST_F(ProgramErrors, NoCloudIsReplacedByItsResult)
{
  const std::string bytes = test::readFile(good_);
  // As in --json *.pcd.
  expectError(2, {"--json", good_, good_}, "is named as a cloud");
  const std::string bare = write("bare", bytes);
  expectError(1, {bare, "--json", bare}, "would replace what it is made from");
  EXPECT_EQ(runProgram(folder_, {"info", bare, "--json", bare}).exit_code, 1);
  EXPECT_EQ(runProgram(folder_, {"info", "--json", good_, good_}).exit_code, 2);
  EXPECT_EQ(test::readFile(good_), bytes);
  EXPECT_EQ(test::readFile(bare), bytes);
}

TEST_F(ProgramErrors, WholeThatFailsNamesTheStatus)
{
  const std::string line = write("line.pcd",
                                 test::pcdHeader(test::kXyzFields, 3, 1, "ascii") +
                                     "0 0 1\n0 .1 1\n0 .2 1\n");
  const ProgramRun run = expectError(1,
                                     {line, "--whole", "--json", "-", "--quiet"},
                                     "line.pcd: no patch: ");
  EXPECT_EQ(run.out, "");
}

TEST_F(ProgramErrors, UnwritableOutput)
{
  const std::string file = write("file", "in the way");
  expectError(1, {good_, "-o", file}, "file: is not a folder");
  expectError(1, {good_, "-o", file + "/below"}, "file: is not a folder");
  expectError(1, {good_, "--json", folder_ + "/no/patches.json"}, "cannot be written");
  expectError(1, {good_, "--json", folder_}, "is a directory");
  expectError(1, {good_, "--json", "/dev/full", "--quiet"}, "/dev/full: ");
  // An old result stays when a new one cannot take its place.
  std::filesystem::create_directories(folder_ + "/out/good.patches.json");
  expectError(1, {good_, "-o", folder_ + "/out", "--quiet"}, "is a directory");
  EXPECT_EQ(test::filesIn(folder_ + "/out"),
            std::vector<std::string>{"good.patches.json"});
}

TEST_F(ProgramErrors, WrongDepthScale)
{
  const std::string image =
      write("depth.pgm", test::pgmBytes(test::bowlCloud(40, 30), 5000.0));
  expectError(1, {image, "--depth-scale", "1"}, "is the depth scale right?");
}

}} // namespace holdfast
