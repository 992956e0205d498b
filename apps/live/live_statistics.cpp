#include "live_statistics.h"

#include <unistd.h>

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <fstream>

namespace holdfast::app {
namespace {

constexpr double kStepsPerMs = 10.0; // of the histogram of latencies

/// Weight of the newest frame in the smoothed figures.
constexpr double kNewest = 0.1;

/// By then every buffer has been filled once.
constexpr std::uint64_t kWarmUpFrames = 100;

double
milliseconds(LiveStatistics::Clock::duration duration)
{
  return std::chrono::duration<double, std::milli>(duration).count();
}

/// Memory of this process that is really in use, MB.
double
residentMegabytes()
{
  std::ifstream statm("/proc/self/statm");
  double total_pages = 0.0;
  double resident_pages = 0.0;
  statm >> total_pages >> resident_pages;
  return 1e-6 * resident_pages * static_cast<double>(::sysconf(_SC_PAGESIZE));
}

} // namespace

void
Histogram::add(std::size_t number)
{
  ++counts_[std::min(number, counts_.size() - 1)];
  ++total_;
  largest_ = std::max(largest_, number);
}

std::size_t
Histogram::quantile(double share) const
{
  const double wanted = share * static_cast<double>(total_);
  std::uint64_t seen = 0;
  for (std::size_t number = 0; number + 1 < counts_.size(); ++number) {
    seen += counts_[number];
    if (seen > 0 && static_cast<double>(seen) >= wanted)
      return number;
  }
  return largest_;
}

void
LiveStatistics::addFrame(Clock::time_point received,
                         const std::vector<ExtractedPatch>& patches)
{
  const std::lock_guard<std::mutex> lock(mutex_);
  const Clock::time_point now = Clock::now();
  const double latency_ms = milliseconds(now - received);
  const double period_ms = milliseconds(now - last_);
  const auto smooth = [this](double& mean, double value, std::uint64_t first) {
    mean = frames_ <= first ? value : mean + kNewest * (value - mean);
  };
  smooth(recent_latency_ms_, latency_ms, 0);
  smooth(recent_patches_, static_cast<double>(patches.size()), 0);
  smooth(recent_period_ms_, period_ms, 1);
  latency_.add(static_cast<std::size_t>(std::lround(kStepsPerMs * latency_ms)));
  patches_.add(patches.size());
  for (const ExtractedPatch& patch : patches)
    points_.add(static_cast<std::size_t>(patch.fit.points));
  if (frames_ == 0)
    first_ = now;
  last_ = now;
  if (++frames_ == kWarmUpFrames)
    early_memory_mb_ = residentMegabytes();
}

std::uint64_t
LiveStatistics::frames() const
{
  const std::lock_guard<std::mutex> lock(mutex_);
  return frames_;
}

std::string
LiveStatistics::pace() const
{
  const std::lock_guard<std::mutex> lock(mutex_);
  const double rate = frames_ > 1 ? 1e3 / std::max(recent_period_ms_, 1e-3) : 0.0;
  return fmt::format("{} frames, {:.1f} Hz", frames_, rate);
}

std::string
LiveStatistics::work() const
{
  const std::lock_guard<std::mutex> lock(mutex_);
  return fmt::format("latency {:.1f} ms, {:.0f} patches",
                     recent_latency_ms_,
                     recent_patches_);
}

std::string
LiveStatistics::overallPace() const
{
  const std::lock_guard<std::mutex> lock(mutex_);
  const double seconds = 1e-3 * milliseconds(last_ - first_);
  const double rate = seconds > 0.0 ? static_cast<double>(frames_ - 1) / seconds : 0.0;
  return fmt::format("{} frames in {:.1f} s, {:.1f} Hz", frames_, seconds, rate);
}

std::string
LiveStatistics::summary(const std::string& dropped) const
{
  const std::string pace = overallPace();
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto latency = [this](double share) {
    return static_cast<double>(latency_.quantile(share)) / kStepsPerMs;
  };
  std::string text = fmt::format("{}, {}\n", pace, dropped);
  text +=
      fmt::format("latency   median {:.1f} ms, 99 % within {:.1f} ms, largest {:.1f} "
                  "ms\n",
                  latency(0.5),
                  latency(0.99),
                  latency(1.0));
  text += fmt::format("patches   median {} a frame, 99 % at least {}, most {}\n",
                      patches_.quantile(0.5),
                      patches_.quantile(0.01),
                      patches_.quantile(1.0));
  text += fmt::format("points    median {} a patch\n", points_.quantile(0.5));
  text += fmt::format("memory    {:.1f} MB", residentMegabytes());
  if (frames_ >= kWarmUpFrames)
    text += fmt::format(", {:.1f} MB after {} frames", early_memory_mb_, kWarmUpFrames);
  return text + "\n";
}

} // namespace holdfast::app
