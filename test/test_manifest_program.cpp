#include <holdfast/io/cloud_io.h>
#include <holdfast/io/patch_io.h>

#include "support/run_program.h"
#include "support/small_clouds.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <sys/types.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <filesystem>
#include <map>
#include <set>
#include <sstream>
#include <thread>

namespace holdfast { namespace {

namespace fs = std::filesystem;
using test::freshFolder;
using test::runProgram;
using Json = nlohmann::json;
using Words = std::vector<std::string>;

/// The clouds bowl_0, bowl_1, ... and their list.
std::string
makeClouds(const std::string& folder, int count, int width = 24)
{
  std::string list;
  fs::create_directories(folder + "/clouds");
  for (int i = 0; i < count; ++i) {
    const std::string path = folder + "/clouds/bowl_" + std::to_string(i) + ".pcd";
    saveCloud(path, test::bowlCloud(width, 18 + i % 5, test::tiltedPose(), true));
    list += path + "\n";
  }
  test::writeFile(folder + "/list.txt", list);
  return folder + "/list.txt";
}

test::ProgramRun
fitList(const std::string& folder, const Words& more)
{
  Words words{"fit", "--manifest", folder + "/list.txt", "--threads", "1"};
  words.insert(words.end(), more.begin(), more.end());
  return runProgram(folder, words);
}

std::set<std::string>
namesIn(const std::string& folder)
{
  std::set<std::string> names;
  for (const std::string& file : test::filesIn(folder))
    names.insert(file.substr(0, file.find('.')));
  return names;
}

/// What is in each file, without how long it took.
std::map<std::string, std::string>
contentOf(const std::string& folder)
{
  std::map<std::string, std::string> content;
  for (const std::string& file : test::filesIn(folder)) {
    std::string text = test::readFile(folder + "/" + file);
    content[file] = text.substr(0, text.find("\n\"timing\""));
  }
  return content;
}

TEST(ManifestProgram, EveryCloudLeavesResultsOrARecord)
{
  const std::string folder = freshFolder("manifest_record");
  makeClouds(folder, 3);
  test::writeFile(folder + "/clouds/bowl_1.pcd", "no cloud");
  fs::remove(folder + "/clouds/bowl_2.pcd");
  const auto run = fitList(folder, {"-o", folder + "/out"});
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_EQ(run.errorLines(), 2) << run.err;
  EXPECT_EQ(test::filesIn(folder + "/out"),
            (Words{"bowl_0.patches.json",
                   "bowl_0.patches.pcd",
                   "bowl_0.patches.ply",
                   "bowl_1.failed.json",
                   "bowl_2.failed.json"}));
  const Json record = Json::parse(test::readFile(folder + "/out/bowl_1.failed.json"));
  EXPECT_EQ(record["name"], "bowl_1");
  EXPECT_EQ(record["cloud"], folder + "/clouds/bowl_1.pcd");
  EXPECT_NE(record["reason"].get<std::string>().find("bowl_1.pcd: "),
            std::string::npos);
  const PatchReport report =
      readJson(test::readFile(folder + "/out/bowl_0.patches.json"));
  EXPECT_EQ(report.fingerprint, record["fingerprint"]);
  EXPECT_EQ(report.fingerprint.size(), 16U);
}

TEST(ManifestProgram, ShardsAreDisjointCompleteAndStable)
{
  const std::string folder = freshFolder("manifest_shards");
  makeClouds(folder, 14);
  std::map<std::string, int> shard_of;
  for (int i = 1; i <= 3; ++i) {
    const std::string out = folder + "/out" + std::to_string(i);
    const auto run =
        fitList(folder, {"-o", out, "--quiet", "--shard", std::to_string(i) + "/3"});
    ASSERT_EQ(run.exit_code, 0) << run.err;
    EXPECT_EQ(run.out + run.err, "");
    for (const std::string& name : namesIn(out))
      EXPECT_TRUE(shard_of.emplace(name, i).second) << name << " is in two shards";
  }
  EXPECT_EQ(shard_of.size(), 14U);
  // Another order and more clouds move none.
  std::string list;
  for (int i = 19; i >= 0; --i)
    list += folder + "/clouds/bowl_" + std::to_string(i) + ".pcd\n";
  makeClouds(folder, 20);
  test::writeFile(folder + "/list.txt", list);
  for (int i = 1; i <= 3; ++i) {
    const std::string out = folder + "/more" + std::to_string(i);
    ASSERT_EQ(
        fitList(folder, {"-o", out, "--shard", std::to_string(i) + "/3"}).exit_code,
        0);
    for (const std::string& name : namesIn(out))
      EXPECT_EQ(shard_of.emplace(name, i).first->second, i) << name;
  }
}

/// When the results of a cloud were written.
fs::file_time_type
timeOf(const std::string& folder, const std::string& name)
{
  return fs::last_write_time(folder + "/" + name + ".patches.json");
}

TEST(ManifestProgram, ResumeLeavesWhatIsDoneAndRetriesOnRequest)
{
  const std::string folder = freshFolder("manifest_resume");
  const std::string out = folder + "/out";
  makeClouds(folder, 3);
  test::writeFile(folder + "/clouds/bowl_2.pcd", "no cloud");
  ASSERT_EQ(fitList(folder, {"-o", out}).exit_code, 2);
  fs::remove(out + "/bowl_1.patches.ply"); // incomplete
  const auto first = timeOf(out, "bowl_0"), second = timeOf(out, "bowl_1");
  saveCloud(folder + "/clouds/bowl_2.pcd",
            test::bowlCloud(24, 18, test::tiltedPose(), true));

  const auto resumed = fitList(folder, {"-o", out, "--resume"});
  EXPECT_EQ(resumed.exit_code, 2) << "a record of failure is still there";
  EXPECT_EQ(timeOf(out, "bowl_0"), first);
  EXPECT_NE(timeOf(out, "bowl_1"), second);
  EXPECT_TRUE(fs::exists(out + "/bowl_1.patches.ply"));
  EXPECT_TRUE(fs::exists(out + "/bowl_2.failed.json"));

  const auto retried = fitList(folder, {"-o", out, "--resume", "--retry-failed"});
  EXPECT_EQ(retried.exit_code, 0) << retried.err;
  EXPECT_EQ(timeOf(out, "bowl_0"), first);
  EXPECT_FALSE(fs::exists(out + "/bowl_2.failed.json"));
  EXPECT_TRUE(fs::exists(out + "/bowl_2.patches.json"));
}

TEST(ManifestProgram, OtherOptionsOrAnotherSensorMakeResultsAnew)
{
  const std::string folder = freshFolder("manifest_fingerprint");
  const std::string out = folder + "/out";
  makeClouds(folder, 1);
  std::set<std::string> fingerprints;
  const auto fitted = [&](const Words& options) {
    Words words{"-o", out, "--resume"};
    words.insert(words.end(), options.begin(), options.end());
    const auto before =
        fs::exists(out) ? timeOf(out, "bowl_0") : fs::file_time_type::min();
    const auto run = fitList(folder, words);
    EXPECT_EQ(run.exit_code, 0) << run.err;
    fingerprints.insert(
        readJson(test::readFile(out + "/bowl_0.patches.json")).fingerprint);
    return timeOf(out, "bowl_0") != before;
  };
  EXPECT_TRUE(fitted({}));
  EXPECT_FALSE(fitted({}));
  EXPECT_FALSE(fitted({"--quiet"})); // says nothing of the results
  EXPECT_TRUE(fitted({"--radius", "0.06"}));
  EXPECT_FALSE(fitted({"--radius", "0.06"}));
  EXPECT_TRUE(fitted({"--sensor", "xtion"}));
  EXPECT_TRUE(fitted({"--no-pattern"}));
  EXPECT_EQ(fingerprints.size(), 4U);
  // A sensor is what its file says, not where it lies; one digit of it counts.
  std::string yaml = test::readFile(HOLDFAST_SOURCE_DIR "/config/sensors/xtion.yaml");
  test::writeFile(folder + "/mine.yaml", yaml);
  EXPECT_TRUE(fitted({"--sensor", folder + "/mine.yaml"}));
  EXPECT_EQ(fingerprints.size(), 4U);
  yaml.replace(yaml.find("fx: 525.0"), 9, "fx: 525.1");
  test::writeFile(folder + "/mine.yaml", yaml);
  EXPECT_TRUE(fitted({"--sensor", folder + "/mine.yaml"}));
  EXPECT_EQ(fingerprints.size(), 5U);
}

TEST(ManifestProgram, FailuresReplaceResultsOfFormerOptions)
{
  const std::string folder = freshFolder("manifest_replace");
  const std::string out = folder + "/out";
  makeClouds(folder, 1);
  ASSERT_EQ(fitList(folder, {"-o", out}).exit_code, 0);
  const auto run = fitList(folder, {"-o", out, "--resume", "--radius", "0.0001"});
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_EQ(test::filesIn(out), Words{"bowl_0.failed.json"});
  // The record is of other options: this is no retry.
  EXPECT_EQ(fitList(folder, {"-o", out, "--resume"}).exit_code, 0);
  EXPECT_EQ(test::filesIn(out).size(), 3U);
}

TEST(ManifestProgram, WrongUsageAndListsExitWithOne)
{
  const std::string folder = freshFolder("manifest_usage");
  const std::string out = folder + "/out";
  makeClouds(folder, 1);
  const auto expect_one = [&](const Words& words, const std::string& cause) {
    const auto run = fitList(folder, words);
    EXPECT_EQ(run.exit_code, 1) << cause;
    EXPECT_EQ(run.errorLines(), 1) << run.err;
    EXPECT_NE(run.err.find(cause), std::string::npos) << run.err;
  };
  expect_one({}, "-o");
  expect_one({"-o", out, "--shard", "0/4"}, "--shard");
  expect_one({"-o", out, "--shard", "5/4"}, "--shard");
  expect_one({"-o", out, "--retry-failed"}, "--resume");
  expect_one({"-o", out, "--radius", "-1"}, "--radius");
  expect_one({"-o", out, folder + "/clouds/bowl_0.pcd"}, "CLOUD");
  expect_one({"-o", folder + "/list.txt"}, "is not a folder");
  test::writeFile(folder + "/list.txt", "a/same.pcd\n# no cloud\n\nb/same.pcd\n");
  expect_one({"-o", out}, "lines 1 and 4");
  test::writeFile(folder + "/list.txt", "\n");
  expect_one({"-o", out}, "lists no cloud");
  fs::remove(folder + "/list.txt");
  expect_one({"-o", out}, "cannot be read");
  // Without a list all is as it was.
  const auto run = runProgram(folder, {"fit", "x.pcd", "--resume"});
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_EQ(runProgram(folder, {"fit"}).exit_code, 2);
}

TEST(ManifestProgram, AByteOrderMarkIsNoPartOfAName)
{
  const std::string folder = freshFolder("manifest_bom");
  const std::string list = makeClouds(folder, 1);
  test::writeFile(list, "\xef\xbb\xbf" + test::readFile(list));
  EXPECT_EQ(fitList(folder, {"-o", folder + "/out"}).exit_code, 0);
}

TEST(ManifestProgram, NamesBehindATabTellCloudsApart)
{
  const std::string folder = freshFolder("manifest_names");
  makeClouds(folder, 1);
  const std::string cloud = folder + "/clouds/bowl_0.pcd";
  test::writeFile(folder + "/list.txt", cloud + "\tfirst\n" + cloud + "\tsecond\n");
  ASSERT_EQ(fitList(folder, {"-o", folder + "/out"}).exit_code, 0);
  EXPECT_EQ(namesIn(folder + "/out"), (std::set<std::string>{"first", "second"}));
}

/// Starts the program and kills it once so many files are there.
void
killWhenThereAre(const std::string& folder, const Words& words, std::size_t files)
{
  const pid_t process = ::fork();
  ASSERT_GE(process, 0);
  if (process == 0) {
    std::vector<char*> arguments;
    for (const std::string& word : words)
      arguments.push_back(const_cast<char*>(word.c_str()));
    arguments.push_back(nullptr);
    ::execv(HOLDFAST_PROGRAM, arguments.data());
    ::_exit(127);
  }
  const auto start = std::chrono::steady_clock::now();
  while ((!fs::exists(folder) || test::filesIn(folder).size() < files) &&
         std::chrono::steady_clock::now() - start < std::chrono::seconds(60))
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  ::kill(process, SIGKILL);
  int status = 0;
  ::waitpid(process, &status, 0);
  ASSERT_TRUE(WIFSIGNALED(status)) << "it was done before it could be killed";
}

TEST(ManifestProgram, KilledInTheMiddleItEndsAsIfItHadNotBeen)
{
  const std::string folder = freshFolder("manifest_kill");
  makeClouds(folder, 20, 40);
  test::writeFile(folder + "/clouds/bowl_7.pcd", "no cloud");
  ASSERT_EQ(fitList(folder, {"-o", folder + "/clean"}).exit_code, 2);
  const std::string out = folder + "/killed";
  const Words words{"holdfast",
                    "fit",
                    "--manifest",
                    folder + "/list.txt",
                    "-o",
                    out,
                    "--resume",
                    "--threads",
                    "1",
                    "--quiet"};
  killWhenThereAre(out, words, 10);
  killWhenThereAre(out, words, 30);
  EXPECT_EQ(fitList(folder, {"-o", out, "--resume"}).exit_code, 2);
  EXPECT_EQ(contentOf(out), contentOf(folder + "/clean"));
}

}} // namespace holdfast
