/// \file What a live run is judged by.
#pragma once

#include <holdfast/pcl/patch_extraction.h>

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <string>
#include <vector>

namespace holdfast::app {

/// Counts of whole numbers, in memory that does not grow with them.
class Histogram {
public:
  /// Numbers from size - 1 on count as the largest of them.
  explicit Histogram(std::size_t size) : counts_(size, 0) {}

  void add(std::size_t number);

  /// The smallest number that at least this share, in (0, 1], do not exceed; 0 without
  /// any.
  std::size_t quantile(double share) const;

private:
  std::vector<std::uint64_t> counts_;
  std::uint64_t total_ = 0;
  std::size_t largest_ = 0;
};

/// Frames, latencies, patches and memory of a run. Any thread may call.
class LiveStatistics {
public:
  using Clock = std::chrono::steady_clock;

  /// A frame is done. \param received when it reached this computer
  void addFrame(Clock::time_point received,
                const std::vector<ExtractedPatch>& patches = {});

  std::uint64_t frames() const;

  /// "1800 frames, 30.0 Hz", the rate smoothed over some frames.
  std::string pace() const;

  /// "latency 18.2 ms, 300 patches", smoothed too.
  std::string work() const;

  /// "1800 frames in 60.0 s, 30.0 Hz".
  std::string overallPace() const;

  /// Lines about rate, latency, patches and memory of the whole run.
  /// \param dropped how many frames were lost, in words.
  std::string summary(const std::string& dropped) const;

private:
  mutable std::mutex mutex_;
  Clock::time_point first_;
  Clock::time_point last_;
  std::uint64_t frames_ = 0;
  Histogram latency_{10000}; ///< in tenths of a millisecond
  Histogram patches_{10000};
  Histogram points_{100000}; ///< of each patch
  double recent_period_ms_ = 0.0;
  double recent_latency_ms_ = 0.0;
  double recent_patches_ = 0.0;
  double early_memory_mb_ = 0.0; ///< when all that is kept has been allocated
};

} // namespace holdfast::app
