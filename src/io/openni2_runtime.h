/// \file What a whole process shares of OpenNI2: its start, its threads, its errors.
#pragma once

#include <pcl/exceptions.h>

#include <functional>
#include <future>
#include <memory>
#include <string>

namespace holdfast::io {

/// A pcl::IOException whose what() is the message alone: PCL puts a source file, line
/// and function before it, or a colon in their place.
class Openni2Error : public pcl::IOException {
public:
  explicit Openni2Error(const std::string& message)
  : pcl::IOException(message), message_(message)
  {}

  const char* what() const noexcept override
  {
    return message_.c_str();
  }

private:
  std::string message_;
};

/// What OpenNI2 says about the last error on this thread, in one line to append;
/// possibly empty.
std::string lastOpenni2Error();

/// Loads OpenNI2 and its drivers if that was not done; within callOpenni2().
/// \throw pcl::IOException when there is no driver.
void initializeOpenni2();

/// True for the path of a file, be it there or not, as opposed to the URI of a camera.
bool isRecordingPath(const std::string& device);

/// The URI or path that Openni2Options::device means. \throw pcl::IOException when
/// there is no driver or no such camera.
std::string resolveDevice(const std::string& device);

/// Runs a job on a thread that never ends.
///
/// OpenNI2 remembers every thread that has ever called one of its functions, and when a
/// new one comes, asks the system whether the others still live, which crashes for one
/// that has ended. So the threads are kept and lent to the next job.
/// \throw pcl::IOException when the system has no more threads.
void runOnLastingThread(std::function<void()> job);

/// Runs a job on the one thread that all devices share.
void runOnOpenni2Thread(std::function<void()> job);

/// Does something with devices and streams, one such job at a time since OpenNI2 keeps
/// its lists of them without locks in places, and waits for it. Always on the same
/// thread: threads of OpenNI2 itself end, too, that of a recorder for one, and a new
/// thread of ours would make it ask for them. \return what the job returns.
/// \throw what it throws.
template <typename Job>
auto
callOpenni2(Job job)
{
  const auto task = std::make_shared<std::packaged_task<decltype(job())()>>(job);
  auto result = task->get_future();
  runOnOpenni2Thread([task] { (*task)(); });
  return result.get();
}

} // namespace holdfast::io
