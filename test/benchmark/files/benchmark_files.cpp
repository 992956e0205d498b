/// \file What files and the start of the program cost.
///
/// `ms` is the least wall time of all repetitions, since anything else on the machine
/// only adds; `of_pcl` is ours over PCL's, measured in turns.
#include "rough_cloud.h"

#include <holdfast/io/atomic_file.h>
#include <holdfast/io/cloud_io.h>
#include <holdfast/io/patch_io.h>
#include <holdfast/pcl/patch_extraction.h>

#include <pcl/io/pcd_io.h>

#include <benchmark/benchmark.h>

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

namespace holdfast::benchmarks { namespace {

/// The least time of what has been run so far.
class Least {
public:
  template <typename Work>
  void run(Work&& work)
  {
    const auto start = std::chrono::steady_clock::now();
    work();
    const std::chrono::duration<double, std::milli> elapsed =
        std::chrono::steady_clock::now() - start;
    ms_ = std::min(ms_, elapsed.count());
  }

  double ms() const
  {
    return ms_;
  }

private:
  double ms_ = std::numeric_limits<double>::infinity();
};

/// A folder that is gone when the program ends.
class ScratchFolder {
public:
  ScratchFolder()
  {
    std::string path =
        (std::filesystem::temp_directory_path() / "holdfast_files_XXXXXX").string();
    if (::mkdtemp(path.data()) == nullptr)
      throw std::runtime_error(path + ": cannot be created");
    path_ = path;
  }

  ~ScratchFolder()
  {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }

  std::string file(const std::string& name) const
  {
    return (path_ / name).string();
  }

private:
  std::filesystem::path path_;
};

const ScratchFolder&
scratch()
{
  static const ScratchFolder folder;
  return folder;
}

/// An organized million: waves with noise, so that nothing compresses but the repeated
/// bytes of the exponents, as in measured clouds.
pcl::PointCloud<pcl::PointXYZ>
millionPoints()
{
  std::mt19937_64 generator(1);
  std::normal_distribution<float> noise(0.0F, 0.003F);
  pcl::PointCloud<pcl::PointXYZ> cloud(1250, 800);
  for (std::uint32_t v = 0; v < cloud.height; ++v)
    for (std::uint32_t u = 0; u < cloud.width; ++u) {
      const float x = (static_cast<float>(u) - 624.5F) / 1000.0F;
      const float y = (static_cast<float>(v) - 399.5F) / 1000.0F;
      const float z = 1.5F + 0.1F * std::sin(10.0F * x) + noise(generator);
      cloud(u, v) = pcl::PointXYZ(x * z, y * z, z);
    }
  return cloud;
}

void
readPcd(benchmark::State& state, bool compressed)
{
  const std::string path = scratch().file(compressed ? "compressed.pcd" : "binary.pcd");
  {
    const auto cloud = millionPoints();
    if (compressed)
      pcl::PCDWriter().writeBinaryCompressed(path, cloud);
    else
      pcl::PCDWriter().writeBinary(path, cloud);
  }
  Least ours, theirs;
  for ([[maybe_unused]] auto _ : state) {
    ours.run([&] { benchmark::DoNotOptimize(loadCloud(path).points->size()); });
    theirs.run([&] {
      pcl::PointCloud<pcl::PointXYZ> cloud;
      benchmark::DoNotOptimize(pcl::io::loadPCDFile(path, cloud));
    });
  }
  state.counters["ms"] = ours.ms();
  state.counters["pcl_ms"] = theirs.ms();
  state.counters["of_pcl"] = ours.ms() / theirs.ms();
}

/// `count` patches of the benchmark's scene, moved about, so that no digits repeat.
PatchReport
patchReport(int count)
{
  const Scene scene = makeScene();
  ExtractionOptions options;
  options.sampler = makeSamplerOptions(Neighborhood::Patch, 0.015);
  options.sampler.spacing_m = 0.03;
  PatchReport report;
  report.cloud = "rough.pcd";
  report.options = options;
  report.result = extractPatches(scene.cloud, scene.sensor, options);
  auto& patches = report.result.patches;
  if (patches.empty())
    throw std::runtime_error("the scene has no patches");
  const std::size_t fitted = patches.size();
  patches.reserve(static_cast<std::size_t>(count));
  std::mt19937_64 generator(1);
  std::uniform_real_distribution<double> move(-1.0, 1.0);
  while (patches.size() < static_cast<std::size_t>(count)) {
    ExtractedPatch patch = patches[patches.size() % fitted];
    const Eigen::Vector3d by(move(generator), move(generator), move(generator));
    patch.fit.patch.c += by;
    patch.fit.state.centre += by;
    patch.seed += by;
    patches.push_back(patch);
  }
  patches.resize(static_cast<std::size_t>(count));
  return report;
}

std::string
readText(const std::string& path)
{
  std::ifstream file(path, std::ios::binary);
  std::string text(std::filesystem::file_size(path), '\0');
  file.read(text.data(), static_cast<std::streamsize>(text.size()));
  return text;
}

void
json(benchmark::State& state)
{
  const PatchReport report = patchReport(static_cast<int>(state.range(0)));
  const std::string path = scratch().file("patches.json");
  Least write, read;
  for ([[maybe_unused]] auto _ : state) {
    write.run([&] {
      AtomicFile file(path);
      writeJson(file.stream(), report, JsonLayout::PatchPerLine);
      file.commit();
    });
    const std::string text = readText(path);
    read.run([&] { benchmark::DoNotOptimize(readJson(text).result.patches.size()); });
  }
  state.counters["write_ms"] = write.ms();
  state.counters["read_ms"] = read.ms();
  state.counters["MB"] = 1e-6 * static_cast<double>(std::filesystem::file_size(path));
}

/// Runs the program and waits for its end.
void
runProgram(std::vector<std::string> arguments)
{
  arguments.insert(arguments.begin(), HOLDFAST_PROGRAM);
  std::vector<char*> argv;
  for (std::string& argument : arguments)
    argv.push_back(argument.data());
  argv.push_back(nullptr);
  const pid_t child = ::fork();
  if (child == 0) {
    const int nowhere = ::open("/dev/null", O_WRONLY);
    ::dup2(nowhere, STDOUT_FILENO);
    ::execv(argv[0], argv.data());
    ::_exit(127);
  }
  int status = 0;
  if (child < 0 || ::waitpid(child, &status, 0) != child || status != 0)
    throw std::runtime_error(std::string(HOLDFAST_PROGRAM) + " failed");
}

void
program(benchmark::State& state, const std::vector<std::string>& arguments)
{
  Least least;
  for ([[maybe_unused]] auto _ : state)
    least.run([&] { runProgram(arguments); });
  state.counters["ms"] = least.ms();
}

void
registerAll()
{
  const auto add = [](const char* name, auto work, auto... with) {
    return benchmark::RegisterBenchmark(name, work, with...)
        ->Unit(benchmark::kMillisecond)
        ->UseRealTime();
  };
  add("program/version", program, std::vector<std::string>{"--version"});
  add("program/fit", // of 34,240 points, at most 10 seeds
      program,
      std::vector<std::string>{"fit", HOLDFAST_SAMPLE, "--quiet", "--seeds", "10"});
  add("read_pcd/binary", readPcd, false);
  add("read_pcd/compressed", readPcd, true);
  add("json/patches", json)->Arg(10000)->Arg(100000);
}

}} // namespace holdfast::benchmarks

int
main(int argc, char** argv)
{
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv))
    return 2;
  holdfast::benchmarks::registerAll();
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
