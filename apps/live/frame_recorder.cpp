#include "frame_recorder.h"

#include "patch_output.h"

#include <holdfast/io/cloud_io.h>

#include <fmt/format.h>

#include <exception>
#include <filesystem>
#include <stdexcept>
#include <system_error>
#include <utility>

namespace holdfast::app {
namespace {

/// A second of a camera's frames, 110 MB.
constexpr std::size_t kMostWaiting = 30;

constexpr const char* kFramePrefix = "frame_";

} // namespace

std::string
frameName(std::uint64_t number)
{
  return fmt::format("{}{:06}", kFramePrefix, number);
}

void
makeFrameFolder(const std::string& folder)
{
  makeFolder(folder);
  const auto isFrame = [](const std::string& name) {
    // A writer that was killed may have left a part of one.
    return name.rfind(kFramePrefix, 0) == 0 &&
           name.find(".holdfast-partial-") == std::string::npos;
  };
  for (const auto& entry : std::filesystem::directory_iterator(folder))
    if (isFrame(entry.path().filename().string()))
      throw std::runtime_error(folder + ": holds frames already");
}

FrameRecorder::FrameRecorder(std::string folder, bool frames_can_wait)
: folder_(std::move(folder)), frames_can_wait_(frames_can_wait)
{
  makeFrameFolder(folder_);
  try {
    thread_ = std::thread([this] { write(); });
  }
  catch (const std::system_error& error) {
    throw std::runtime_error(folder_ + ": no thread to write with: " + error.what());
  }
}

FrameRecorder::~FrameRecorder()
{
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    over_ = true;
    changed_.notify_all();
  }
  thread_.join();
}

void
FrameRecorder::throwError() const
{
  if (!error_.empty())
    throw std::runtime_error(error_);
}

void
FrameRecorder::push(const RangeFrame::ConstPtr& frame)
{
  std::unique_lock<std::mutex> lock(mutex_);
  if (frames_can_wait_)
    changed_.wait(lock,
                  [this] { return waiting_.size() < kMostWaiting || !error_.empty(); });
  throwError();
  ++pushed_;
  if (waiting_.size() >= kMostWaiting) {
    ++dropped_;
    return;
  }
  waiting_.emplace_back(pushed_, frame);
  changed_.notify_all();
}

void
FrameRecorder::finish()
{
  std::unique_lock<std::mutex> lock(mutex_);
  changed_.wait(lock, [this] { return waiting_.empty() || !error_.empty(); });
  throwError();
}

std::uint64_t
FrameRecorder::dropped() const
{
  const std::lock_guard<std::mutex> lock(mutex_);
  return dropped_;
}

void
FrameRecorder::write()
{
  std::unique_lock<std::mutex> lock(mutex_);
  while (error_.empty()) {
    changed_.wait(lock, [this] { return over_ || !waiting_.empty(); });
    if (waiting_.empty())
      return;
    const auto [number, frame] = waiting_.front();
    lock.unlock();
    std::string error;
    try {
      saveCloud(folder_ + "/" + frameName(number) + ".pcd", frame->cloud);
    }
    catch (const std::exception& failure) {
      error = failure.what();
    }
    lock.lock();
    error_ = error;
    waiting_.pop_front();
    changed_.notify_all();
  }
}

} // namespace holdfast::app
