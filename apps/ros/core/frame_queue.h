/// \file Frames on their way from the thread that receives to the one that works.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <mutex>
#include <optional>
#include <utility>

namespace holdfast::robot {

/// Holds the newest frames. One that comes when as many wait as may takes the place of
/// the oldest, which is counted as dropped.
template <typename Frame>
class FrameQueue {
public:
  explicit FrameQueue(std::size_t most_waiting) : most_waiting_(most_waiting) {}

  void put(Frame frame)
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    ++received_;
    if (waiting_.size() >= most_waiting_) {
      waiting_.pop_front();
      ++dropped_;
    }
    waiting_.push_back(std::move(frame));
    changed_.notify_one();
  }

  /// Waits for a frame. \return nothing once the queue is closed.
  std::optional<Frame> take()
  {
    std::unique_lock<std::mutex> lock(mutex_);
    changed_.wait(lock, [this] { return is_closed_ || !waiting_.empty(); });
    if (is_closed_)
      return std::nullopt;
    std::optional<Frame> frame(std::move(waiting_.front()));
    waiting_.pop_front();
    return frame;
  }

  /// Frames that still wait are given up.
  void close()
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    is_closed_ = true;
    changed_.notify_all();
  }

  std::uint64_t received() const
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    return received_;
  }

  std::uint64_t dropped() const
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    return dropped_;
  }

private:
  const std::size_t most_waiting_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Frame> waiting_;
  std::uint64_t received_ = 0;
  std::uint64_t dropped_ = 0;
  bool is_closed_ = false;
};

} // namespace holdfast::robot
