#include <holdfast/io/cloud_io.h>

#include "support/run_program.h"
#include "support/small_clouds.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <filesystem>

namespace holdfast { namespace {

namespace fs = std::filesystem;
using test::freshFolder;
using test::runProgram;
using Json = nlohmann::json;

/// Three clouds, one of them broken, fitted to `out` in this format.
void
makeResults(const std::string& folder,
            const std::string& out,
            const std::string& format)
{
  std::string list;
  for (int i = 0; i < 3; ++i) {
    const std::string path = folder + "/bowl_" + std::to_string(i) + ".pcd";
    saveCloud(path, test::bowlCloud(24, 18 + i, test::tiltedPose(), true));
    list += path + "\n";
  }
  test::writeFile(folder + "/bowl_1.pcd", "no cloud");
  test::writeFile(folder + "/list.txt", list);
  const auto run = runProgram(
      folder,
      {"fit", "--manifest", folder + "/list.txt", "-o", out, "--format", format});
  ASSERT_EQ(run.exit_code, 2) << run.err;
}

/// True where this program has HDF5; says so where it has not.
bool
hasColumns(const std::string& folder)
{
  const auto run = runProgram(folder, {"collect", folder, "-o", folder + "/probe.h5"});
  return run.err.find("without its module") == std::string::npos;
}

/// The data set as Python sees it; null where it has no h5py or pandas.
Json
readByPython(const std::string& folder, const std::string& file)
{
  const auto run =
      test::runExecutable(folder,
                          "python3",
                          {HOLDFAST_SOURCE_DIR "/test/support/read_columns.py", file});
  if (run.exit_code != 0) {
    EXPECT_TRUE(run.exit_code == 77 || run.exit_code == 127) << run.err;
    return {};
  }
  return Json::parse(run.out);
}

std::vector<double>
lowerTriangle(const Json& matrix)
{
  std::vector<double> triangle;
  for (std::size_t i = 0; i < matrix.size(); ++i)
    for (std::size_t j = 0; j <= i; ++j)
      triangle.push_back(matrix[i][j]);
  return triangle;
}

TEST(CollectProgram, ColumnsHoldWhatTheResultsSay)
{
  const std::string folder = freshFolder("collect_columns");
  if (!hasColumns(folder))
    GTEST_SKIP() << "built without HDF5";
  makeResults(folder, folder + "/out", "json");
  const std::string file = folder + "/dataset.h5";
  const auto run =
      runProgram(folder, {"collect", folder + "/out", "-o", file, "--json", "-"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const Json first = Json::parse(test::readFile(folder + "/out/bowl_0.patches.json"));
  const Json last = Json::parse(test::readFile(folder + "/out/bowl_2.patches.json"));
  const Json summary = Json::parse(run.out);
  EXPECT_EQ(summary["clouds"], 2);
  EXPECT_EQ(summary["failed"], 1);
  EXPECT_EQ(summary["patches"], first["patches"].size() + last["patches"].size());
  EXPECT_EQ(summary["clouds_by_fingerprint"].size(), 1U);
  EXPECT_FALSE(fs::exists(file + ".holdfast-spool"));

  const Json seen = readByPython(folder, file);
  if (seen.is_null())
    GTEST_SKIP() << "no python3 with h5py and pandas";
  const Json& patch = first["patches"][0];
  EXPECT_EQ(seen["rows"], summary["patches"]);
  EXPECT_EQ(seen["clouds"], (Json{"bowl_0", "bowl_2"}));
  EXPECT_EQ(seen["patches_of"][0], first["patches"].size());
  EXPECT_EQ(seen["cloud_of_last"], "bowl_2");
  EXPECT_EQ(seen["surface_of_first"], patch["surface"]);
  EXPECT_EQ(seen["state"], patch["state"]);
  EXPECT_EQ(seen["parameters"], patch["parameters"]);
  EXPECT_EQ(seen["state_covariance"], Json(lowerTriangle(patch["state_covariance"])));
  EXPECT_EQ(seen["chi2"], patch["chi2"]);
  EXPECT_EQ(seen["points"], patch["points"]);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(seen["normal"][i], patch["state_frame"][i][2]);
    EXPECT_EQ(seen["centre"][i], patch["state"][patch["state"].size() - 3 + i]);
    EXPECT_EQ(seen["position"][i], first["sensor"]["position"][i]);
  }
  ASSERT_EQ(seen["settings"].size(), 2U); // the cameras are of two sizes
  EXPECT_EQ(seen["settings"][0]["options"], first["options"]);
  EXPECT_EQ(seen["failed"], Json{"bowl_1"});
}

TEST(CollectProgram, ColumnsOfShardsGiveTheSameDataSet)
{
  const std::string folder = freshFolder("collect_formats");
  if (!hasColumns(folder))
    GTEST_SKIP() << "built without HDF5";
  makeResults(folder, folder + "/json", "json");
  makeResults(folder, folder + "/h5", "h5");
  EXPECT_EQ(test::filesIn(folder + "/h5"),
            (std::vector<std::string>{"bowl_0.patches.h5",
                                      "bowl_1.failed.json",
                                      "bowl_2.patches.h5"}));
  for (const std::string format : {"json", "h5"}) {
    const auto run = runProgram(
        folder,
        {"collect", folder + "/" + format, "-o", folder + "/" + format + ".h5"});
    ASSERT_EQ(run.exit_code, 0) << run.err;
  }
  EXPECT_EQ(test::readFile(folder + "/json.h5"), test::readFile(folder + "/h5.h5"));
  // And they are results to go on with.
  const auto resumed = runProgram(folder,
                                  {"fit",
                                   "--manifest",
                                   folder + "/list.txt",
                                   "-o",
                                   folder + "/h5",
                                   "--format",
                                   "h5",
                                   "--resume"});
  EXPECT_NE(resumed.out.find(" 0 fitted, 0 failed; before: 2 fitted, 1 failed"),
            std::string::npos)
      << resumed.out;
}

TEST(CollectProgram, GoesOnWhereItWasKilled)
{
  const std::string folder = freshFolder("collect_resume");
  if (!hasColumns(folder))
    GTEST_SKIP() << "built without HDF5";
  makeResults(folder, folder + "/out", "json");
  const auto collected = [&](const std::string& file) {
    return runProgram(folder, {"collect", folder + "/out", "-o", folder + "/" + file});
  };
  ASSERT_EQ(collected("whole.h5").exit_code, 0);
  // Where the file cannot be written in the end, what was read is kept.
  fs::create_directory(folder + "/again.h5");
  EXPECT_EQ(collected("again.h5").exit_code, 1);
  const std::string spool = folder + "/again.h5.holdfast-spool";
  ASSERT_TRUE(fs::exists(spool));
  fs::remove(folder + "/again.h5");
  fs::resize_file(spool, fs::file_size(spool) - 100); // killed within the last
  const auto run = collected("again.h5");
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_NE(run.err.find("behind 2 of 3"), std::string::npos) << run.err;
  EXPECT_EQ(test::readFile(folder + "/again.h5"), test::readFile(folder + "/whole.h5"));
}

TEST(CollectProgram, BrokenResultsAreNamed)
{
  const std::string folder = freshFolder("collect_broken");
  if (!hasColumns(folder))
    GTEST_SKIP() << "built without HDF5";
  makeResults(folder, folder + "/out", "json");
  const std::string broken = folder + "/out/bowl_0.patches.json";
  const std::string text = test::readFile(broken);
  test::writeFile(broken, text.substr(0, text.size() / 2));
  const auto run =
      runProgram(folder, {"collect", folder + "/out", "-o", folder + "/dataset.h5"});
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_EQ(run.errorLines(), 1) << run.err;
  EXPECT_NE(run.err.find("bowl_0.patches.json: "), std::string::npos) << run.err;
  EXPECT_TRUE(fs::exists(folder + "/dataset.h5")); // of the others
  fs::create_directory(folder + "/empty");
  EXPECT_EQ(runProgram(folder, {"collect", folder + "/empty", "-o", folder + "/e.h5"})
                .exit_code,
            1);
}

}} // namespace holdfast
