#include "openni2_runtime.h"

#include <holdfast/io/openni2_grabber.h>

#include <OpenNI.h>
#include <fmt/core.h>

#include <algorithm>
#include <condition_variable>
#include <cstdlib>
#include <deque>
#include <filesystem>
#include <limits>
#include <mutex>
#include <system_error>
#include <thread>
#include <utility>

namespace holdfast {

namespace io {

namespace {

class LastingThreads {
public:
  explicit LastingThreads(std::size_t most) : most_(most) {}

  /// \throw Openni2Error when there is no thread to be had; the job is forgotten then.
  void run(std::function<void()> job)
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    jobs_.push_back(std::move(job));
    if (jobs_.size() > idle_ && threads_ < most_)
      addThread();
    else
      has_job_.notify_one();
  }

private:
  void addThread()
  {
    try {
      std::thread([this] { work(); }).detach();
      ++threads_;
    }
    catch (const std::system_error& error) {
      jobs_.pop_back();
      throw Openni2Error(std::string("no thread for the camera: ") + error.what());
    }
    catch (...) {
      jobs_.pop_back();
      throw;
    }
  }

  [[noreturn]] void work()
  {
    for (;;)
      nextJob()();
  }

  std::function<void()> nextJob()
  {
    std::unique_lock<std::mutex> lock(mutex_);
    ++idle_;
    has_job_.wait(lock, [this] { return !jobs_.empty(); });
    --idle_;
    std::function<void()> job = std::move(jobs_.front());
    jobs_.pop_front();
    return job;
  }

  std::mutex mutex_;
  std::condition_variable has_job_;
  std::deque<std::function<void()>> jobs_;
  const std::size_t most_;
  std::size_t threads_ = 0;
  std::size_t idle_ = 0;
};

} // namespace

std::string
lastOpenni2Error()
{
  std::string text = openni::OpenNI::getExtendedError();
  while (!text.empty() && (text.back() == '\n' || text.back() == ' '))
    text.pop_back();
  std::replace(text.begin(), text.end(), '\n', ' ');
  return text.empty() ? text : " (" + text + ")";
}

void
initializeOpenni2()
{
  // Never shut down: a pcl::io::OpenNI2Grabber of the same program uses it, too, and
  // unloading drivers whose threads have not ended is how programs crash at exit.
  static const openni::Status status = openni::OpenNI::initialize();
  if (status != openni::STATUS_OK)
    throw Openni2Error("OpenNI2 finds no driver" + lastOpenni2Error());
}

bool
isRecordingPath(const std::string& device)
{
  std::error_code error;
  return std::filesystem::path(device).extension() == ".oni" ||
         std::filesystem::is_regular_file(device, error);
}

std::string
resolveDevice(const std::string& device)
{
  if (isRecordingPath(device))
    return device;
  const std::string digits = device.substr(device.rfind('#', 0) == 0 ? 1 : 0);
  const bool is_number =
      !digits.empty() && digits.find_first_not_of("0123456789") == std::string::npos;
  if (!device.empty() && !is_number)
    return device;
  const auto devices = listOpenni2Devices();
  if (devices.empty())
    throw Openni2Error("OpenNI2 sees no depth camera: is one plugged in, and its "
                       "driver installed?");
  const unsigned long number =
      is_number ? std::strtoul(digits.c_str(), nullptr, 10) : 1;
  if (number < 1 || number > devices.size())
    throw Openni2Error(
        fmt::format("there is no camera #{}: OpenNI2 sees {}", digits, devices.size()));
  return devices[number - 1].uri;
}

void
runOnLastingThread(std::function<void()> job)
{
  // Never destroyed: its threads wait in it to the end of the process.
  static auto& threads = *new LastingThreads(std::numeric_limits<std::size_t>::max());
  threads.run(std::move(job));
}

void
runOnOpenni2Thread(std::function<void()> job)
{
  static auto& thread = *new LastingThreads(1);
  thread.run(std::move(job));
}

} // namespace io

std::vector<Openni2DeviceInfo>
listOpenni2Devices()
{
  return io::callOpenni2([] {
    io::initializeOpenni2();
    openni::Array<openni::DeviceInfo> found;
    openni::OpenNI::enumerateDevices(&found);
    std::vector<Openni2DeviceInfo> devices;
    for (int i = 0; i < found.getSize(); ++i)
      if (!io::isRecordingPath(found[i].getUri()))
        devices.push_back(
            {found[i].getUri(), found[i].getVendor(), found[i].getName()});
    return devices;
  });
}

} // namespace holdfast
