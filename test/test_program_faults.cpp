// Full disks, signals, and too little of everything: one line, and nothing partial.
#include <holdfast/io/cloud_io.h>

#include "support/run_program.h"
#include "support/small_clouds.h"

#include <gtest/gtest.h>

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <thread>

namespace holdfast { namespace {

namespace fs = std::filesystem;
using test::filesIn;
using test::freshFolder;
using test::ProgramRun;
using test::shellQuoted;
using Names = std::vector<std::string>;

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kIsSanitized = true;
#else
constexpr bool kIsSanitized = false;
#endif

class ProgramFaults : public testing::Test {
protected:
  void SetUp() override
  {
    folder_ =
        freshFolder(std::string("faults_") +
                    testing::UnitTest::GetInstance()->current_test_info()->name());
    cloud_ = folder_ + "/bowl.pcd";
    saveCloud(cloud_, test::bowlCloud(120, 90));
  }

  /// Runs a shell's script, in which $HOLDFAST is the program.
  ProgramRun shell(const std::string& script) const
  {
    return test::runExecutable(
        folder_,
        "/bin/sh",
        {"-c", "HOLDFAST=" + shellQuoted(HOLDFAST_PROGRAM) + "\n" + script});
  }

  /// Starts the program with its standard output and error in a file.
  pid_t start(const std::vector<std::string>& arguments, int out = -1) const
  {
    std::vector<char*> words{const_cast<char*>(HOLDFAST_PROGRAM)};
    for (const std::string& argument : arguments)
      words.push_back(const_cast<char*>(argument.c_str()));
    words.push_back(nullptr);
    const pid_t child = ::fork();
    if (child == 0) {
      const std::string log = folder_ + "/log.txt";
      const int file = ::open(log.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
      ::dup2(out >= 0 ? out : file, STDOUT_FILENO);
      ::dup2(file, STDERR_FILENO);
      ::execv(HOLDFAST_PROGRAM, words.data());
      ::_exit(127);
    }
    return child;
  }

  static int waitFor(pid_t child)
  {
    int status = 0;
    ::waitpid(child, &status, 0);
    return status;
  }

  /// Waits until a file of that name, or part of a name, is there.
  static bool appears(const std::string& folder, const std::string& part)
  {
    for (int i = 0; i < 2000; ++i) {
      for (const std::string& name : filesIn(folder))
        if (name.find(part) != std::string::npos)
          return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    return false;
  }

  /// A fit that takes its time.
  std::vector<std::string> longFit(const std::string& out) const
  {
    return {"fit",
            cloud_,
            "--quiet",
            "--radius",
            "0.3",
            "--spacing",
            "0.001",
            "--covariance",
            "monte-carlo",
            "--json",
            out + "/result.json"};
  }

  static void expectOneLine(const ProgramRun& run, const std::string& what)
  {
    EXPECT_EQ(run.errorLines(), 1) << run.err;
    EXPECT_EQ(run.err.rfind("holdfast: ", 0), 0U) << run.err;
    EXPECT_NE(run.err.find(what), std::string::npos) << run.err;
  }

  std::string folder_;
  std::string cloud_;
};

TEST_F(ProgramFaults, ALimitOnTheSizeOfFilesIsLikeAFullDisk)
{
  const std::string out = folder_ + "/out";
  for (const int blocks : {0, 1, 2, 20}) { // of 512 bytes
    fs::remove_all(out);
    const ProgramRun run =
        shell("ulimit -f " + std::to_string(blocks) + "\n$HOLDFAST fit " +
              shellQuoted(cloud_) + " --quiet -o " + shellQuoted(out) + " 2>&1");
    SCOPED_TRACE(std::to_string(blocks) + " blocks: " + run.out);
    EXPECT_EQ(run.exit_code, 1);
    EXPECT_NE(run.out.find(out + "/bowl.patches."), std::string::npos);
    EXPECT_NE(run.out.find(": cannot be written: File too large\n"), std::string::npos);
    EXPECT_EQ(std::count(run.out.begin(), run.out.end(), '\n'), 1);
    EXPECT_EQ(filesIn(out), Names{});
  }
}

TEST_F(ProgramFaults, FullDisk)
{
  const std::string disk = folder_ + "/disk";
  fs::create_directories(disk);
  const std::string mount = "mount -t tmpfs -o size=16k none " + shellQuoted(disk);
  if (shell("unshare -m sh -c " + shellQuoted(mount)).exit_code != 0)
    GTEST_SKIP() << "no private mounts for this user";
  struct Case {
    std::string arguments;
    std::string file;
  };
  const std::string in = " " + shellQuoted(cloud_) + " ";
  for (const Case& c : std::vector<Case>{
           {"fit" + in + "--quiet -o " + disk + "/out", "out/bowl.patches."},
           {"fit" + in + "--quiet --spacing 0.02 --json " + disk + "/a.json", "a.json"},
           {"render --types -o " + disk + "/a.png", "a.png"},
           {"simulate rocks --stride 4 -o " + disk + "/a.pcd", "a.pcd"}}) {
    const ProgramRun run =
        shell("unshare -m sh -c " +
              shellQuoted(mount + " && { " + HOLDFAST_PROGRAM + " " + c.arguments +
                          "; code=$?; find " + disk + " -type f; exit $code; }"));
    SCOPED_TRACE(c.arguments);
    EXPECT_EQ(run.exit_code, 1);
    expectOneLine(run, disk + "/" + c.file);
    expectOneLine(run, ": cannot be written: No space left on device");
    EXPECT_EQ(run.out, ""); // no file
  }
}

TEST_F(ProgramFaults, SignalsEndItWithoutLitter)
{
  const std::string out = folder_ + "/out";
  fs::create_directories(out);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGPIPE, SIGQUIT}) {
    test::writeFile(out + "/result.json", "old");
    const pid_t child = start(longFit(out));
    ASSERT_TRUE(appears(out, "partial"));
    ::kill(child, signal);
    const int status = waitFor(child);
    EXPECT_TRUE(WIFSIGNALED(status)) << signal;
    EXPECT_EQ(WTERMSIG(status), signal);
    EXPECT_EQ(filesIn(out), Names{"result.json"}) << signal;
    EXPECT_EQ(test::readFile(out + "/result.json"), "old");
  }
}

TEST_F(ProgramFaults, AReaderThatHasGoneLeavesNoLitter)
{
  const std::string out = folder_ + "/out";
  fs::create_directories(out);
  int ends[2];
  ASSERT_EQ(::pipe(ends), 0);
  ::close(ends[0]);
  const pid_t child =
      start({"fit", cloud_, "--whole", "--json", out + "/result.json"}, ends[1]);
  ::close(ends[1]);
  const int status = waitFor(child);
  EXPECT_TRUE(WIFSIGNALED(status) && WTERMSIG(status) == SIGPIPE) << status;
  EXPECT_EQ(filesIn(out), Names{});
}

TEST_F(ProgramFaults, TheNextRunRemovesWhatAKilledOneLeft)
{
  const std::string out = folder_ + "/out";
  fs::create_directories(out);
  const pid_t child = start(longFit(out));
  ASSERT_TRUE(appears(out, "partial"));
  ::kill(child, SIGKILL);
  waitFor(child);
  EXPECT_EQ(filesIn(out).size(), 1U);
  const ProgramRun run = test::runProgram(
      folder_,
      {"fit", cloud_, "--whole", "--quiet", "--json", out + "/result.json"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_EQ(filesIn(out), Names{"result.json"});
}

/// Runs a command with little more memory than the system needs to load the program.
class LittleMemory : public ProgramFaults {
protected:
  ProgramRun runWithin(int megabytes, const std::string& command) const
  {
    const std::string out = folder_ + "/out";
    fs::remove_all(out);
    fs::create_directories(out);
    return shell("ulimit -c 0; ulimit -v " + std::to_string(1024 * megabytes) +
                 "\ncd " + shellQuoted(out) + "\n$HOLDFAST " + command);
  }

  /// The least in which it comes to its main(), MB: with less, the loader gives up, or
  /// a static object of some library ends it before anybody can catch.
  int leastToLoad() const
  {
    constexpr int kNotLoaded = 127, kAborted = 134;
    int too_little = 0, enough = 2000;
    while (enough - too_little > 1) {
      const int between = (too_little + enough) / 2;
      const int exit_code = runWithin(between, "--version").exit_code;
      const bool loaded = exit_code != kNotLoaded && exit_code != kAborted;
      (loaded ? enough : too_little) = between;
    }
    return enough;
  }

  void expectOneLineOrSuccess(const std::string& command, const Names& files)
  {
    if (kIsSanitized)
      GTEST_SKIP() << "sanitizers need more memory than that";
    const int least = leastToLoad();
    int failures = 0;
    for (const int more : {0, 2, 4, 6, 8, 10, 13, 16, 20, 25, 30, 40, 60, 100, 1000}) {
      const ProgramRun run = runWithin(least + more, command);
      SCOPED_TRACE(std::to_string(least + more) + " MB: " + run.err);
      ASSERT_TRUE(run.exit_code == 0 || run.exit_code == 1) << run.exit_code;
      EXPECT_EQ(filesIn(folder_ + "/out"), run.exit_code == 0 ? files : Names{});
      if (run.exit_code == 1)
        expectOneLine(run, "memory");
      failures += run.exit_code;
    }
    EXPECT_GT(failures, 0) << "there was enough in every run";
    EXPECT_LT(failures, 15) << "there was too little in every run";
  }
};

TEST_F(LittleMemory, Fit)
{
  expectOneLineOrSuccess("fit ../bowl.pcd --quiet --spacing 0.02 -o .",
                         {"bowl.patches.json", "bowl.patches.pcd", "bowl.patches.ply"});
}

TEST_F(LittleMemory, FitOnManyThreads)
{
  expectOneLineOrSuccess(
      "fit ../bowl.pcd --quiet --spacing 0.02 --threads 64 --json bowl.json",
      {"bowl.json"});
}

TEST_F(LittleMemory, Info)
{
  // Large enough to want memory of its own.
  saveCloud(folder_ + "/large.pcd", test::bowlCloud(1200, 900));
  expectOneLineOrSuccess("info ../large.pcd --quiet --json bowl.json", {"bowl.json"});
}

TEST_F(LittleMemory, Render)
{
  expectOneLineOrSuccess("render --types -o types.png", {"types.png"});
}

TEST_F(LittleMemory, Experiment)
{
  expectOneLineOrSuccess(
      "experiment consistency --quiet --trials 2 --threads 64 --json a.json",
      {"a.json"});
}

}} // namespace holdfast
