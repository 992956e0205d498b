// A driver for OpenNI2 that serves a computed scene in place of a camera, and fails
// when it is told to.
#include "virtual_kinect.h"

#include "scene.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <map>
#include <memory>
#include <mutex>
#include <new>
#include <set>
#include <sstream>
#include <string>
#include <thread>
#include <tuple>
#include <utility>
#include <vector>

// What the driver interface expects to be told; the names of OpenNI's own allocator.
#define XN_NEW(type, ...) new type(__VA_ARGS__)
#define XN_DELETE(pointer) delete (pointer)
#include <Driver/OniDriverAPI.h>

namespace virtual_kinect {

namespace {

using Clock = std::chrono::steady_clock;

struct Settings {
  int fps = kFramesPerSecond;
  bool color = true;
  bool depth = true;
  bool rgb = true;
  bool start_fails = false;
  bool mirror_sticks = false;
  int unplug_at = 0; ///< 0: never
  int replug_after_ms = 0;
  int stall_at = 0;
  int error_at = 0;
};

OniVideoMode
videoMode(OniPixelFormat format, int width, int height)
{
  return {format, width, height, kFramesPerSecond};
}

std::vector<OniVideoMode>
videoModes(OniSensorType type, const Settings& settings)
{
  OniPixelFormat format = ONI_PIXEL_FORMAT_DEPTH_1_MM;
  if (type == ONI_SENSOR_COLOR)
    format = settings.rgb ? ONI_PIXEL_FORMAT_RGB888 : ONI_PIXEL_FORMAT_YUV422;
  return {videoMode(format, 640, 480), videoMode(format, 320, 240)};
}

using Image = std::vector<std::uint16_t>;

/// Computed when it is first wanted and kept for the life of the process, so that
/// serving it again costs next to nothing.
const Image&
depthImage(int frame, int width, int height)
{
  static std::mutex mutex;
  static std::map<std::tuple<int, int, int>, Image> images;
  const std::lock_guard<std::mutex> lock(mutex);
  Image& image = images[{frame % kPeriod, width, height}];
  if (image.empty())
    for (int v = 0; v < height; ++v)
      for (int u = 0; u < width; ++u)
        image.push_back(depthMm(frame, u, v, width, height));
  return image;
}

template <typename T>
OniStatus
answer(const T& value, void* data, int* size)
{
  if (*size != static_cast<int>(sizeof(T)))
    return ONI_STATUS_BAD_PARAMETER;
  std::memcpy(data, &value, sizeof(T));
  return ONI_STATUS_OK;
}

template <typename T>
OniStatus
take(T& value, const void* data, int size)
{
  if (size != static_cast<int>(sizeof(T)))
    return ONI_STATUS_BAD_PARAMETER;
  std::memcpy(&value, data, sizeof(T));
  return ONI_STATUS_OK;
}

class Stream : public oni::driver::StreamBase {
public:
  Stream(OniSensorType type, const Settings& settings)
  : type_(type)
  , start_fails_(settings.start_fails)
  , mirror_sticks_(settings.mirror_sticks)
  , modes_(videoModes(type, settings))
  , mode_(modes_.front())
  {}

  OniStatus start() override
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (start_fails_)
      return ONI_STATUS_ERROR;
    started_ = true;
    return ONI_STATUS_OK;
  }

  void stop() override
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    started_ = false;
  }

  bool isStarted() const
  {
    return started_;
  }

  OniBool isPropertySupported(int id) override
  {
    return id == ONI_STREAM_PROPERTY_VIDEO_MODE ||
           id == ONI_STREAM_PROPERTY_MIRRORING || id == ONI_STREAM_PROPERTY_CROPPING ||
           id == ONI_STREAM_PROPERTY_HORIZONTAL_FOV ||
           id == ONI_STREAM_PROPERTY_VERTICAL_FOV ||
           (id == ONI_STREAM_PROPERTY_MAX_VALUE && type_ == ONI_SENSOR_DEPTH);
  }

  OniStatus getProperty(int id, void* data, int* size) override
  {
    const bool is_depth = type_ == ONI_SENSOR_DEPTH;
    switch (id) {
    case ONI_STREAM_PROPERTY_VIDEO_MODE:
      return answer(mode_, data, size);
    case ONI_STREAM_PROPERTY_HORIZONTAL_FOV:
      return answer(is_depth ? kDepthHorizontalFov : kColorHorizontalFov, data, size);
    case ONI_STREAM_PROPERTY_VERTICAL_FOV:
      return answer(is_depth ? kDepthVerticalFov : kColorVerticalFov, data, size);
    case ONI_STREAM_PROPERTY_MAX_VALUE:
      return is_depth ? answer(kMaxDepthMm, data, size) : ONI_STATUS_NOT_SUPPORTED;
    case ONI_STREAM_PROPERTY_MIRRORING:
      return answer(mirrored_, data, size);
    case ONI_STREAM_PROPERTY_CROPPING: // players give no frames of a recording without
                                       // it
      return answer(OniCropping{FALSE, 0, 0, 0, 0}, data, size);
    default:
      return ONI_STATUS_NOT_SUPPORTED;
    }
  }

  OniStatus setProperty(int id, const void* data, int size) override
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    switch (id) {
    case ONI_STREAM_PROPERTY_VIDEO_MODE:
      return setVideoMode(data, size);
    case ONI_STREAM_PROPERTY_MIRRORING:
      return mirror_sticks_ ? ONI_STATUS_NOT_SUPPORTED : take(mirrored_, data, size);
    default:
      return ONI_STATUS_NOT_SUPPORTED;
    }
  }

  /// Hands out a frame if the stream is started; after stop() none is under way.
  void deliver(int index)
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!started_)
      return;
    OniFrame* frame = getServices().acquireFrame();
    if (frame == nullptr)
      return;
    describe(*frame, index);
    fill(*frame, index);
    raiseNewFrame(frame);
    getServices().releaseFrame(frame);
  }

private:
  OniStatus setVideoMode(const void* data, int size)
  {
    OniVideoMode wanted;
    if (take(wanted, data, size) != ONI_STATUS_OK)
      return ONI_STATUS_BAD_PARAMETER;
    for (const OniVideoMode& mode : modes_)
      if (std::memcmp(&mode, &wanted, sizeof(mode)) == 0) {
        mode_ = mode;
        return ONI_STATUS_OK;
      }
    return ONI_STATUS_NOT_SUPPORTED;
  }

  int bytesPerPixel() const
  {
    return type_ == ONI_SENSOR_DEPTH || !isRgb() ? 2 : 3;
  }

  bool isRgb() const
  {
    return mode_.pixelFormat == ONI_PIXEL_FORMAT_RGB888;
  }

  void describe(OniFrame& frame, int index) const
  {
    frame.sensorType = type_;
    frame.videoMode = mode_;
    frame.width = mode_.resolutionX;
    frame.height = mode_.resolutionY;
    frame.stride = frame.width * bytesPerPixel();
    frame.dataSize = frame.stride * frame.height;
    frame.frameIndex = index;
    frame.timestamp = timestampUs(index);
    frame.croppingEnabled = FALSE;
    frame.cropOriginX = 0;
    frame.cropOriginY = 0;
  }

  void fill(OniFrame& frame, int index)
  {
    if (type_ == ONI_SENSOR_DEPTH)
      fillDepth(static_cast<std::uint16_t*>(frame.data), index);
    else if (isRgb())
      fillColor(static_cast<std::uint8_t*>(frame.data), index);
    else
      std::memset(frame.data, 128, static_cast<std::size_t>(frame.dataSize));
  }

  void fillDepth(std::uint16_t* out, int index) const
  {
    const auto width = mode_.resolutionX;
    const auto& image = depthImage(index, width, mode_.resolutionY);
    if (mirrored_ == FALSE) {
      std::copy(image.begin(), image.end(), out);
      return;
    }
    for (auto row = image.begin(); row != image.end(); row += width, out += width)
      std::reverse_copy(row, row + width, out);
  }

  void fillColor(std::uint8_t* out, int index) const
  {
    for (int v = 0; v < mode_.resolutionY; ++v)
      for (int column = 0; column < mode_.resolutionX; ++column, out += 3) {
        const int u = mirrored_ == TRUE ? mode_.resolutionX - 1 - column : column;
        const auto rgb = color(index, u, v);
        std::copy(rgb.begin(), rgb.end(), out);
      }
  }

  const OniSensorType type_;
  const bool start_fails_;
  const bool mirror_sticks_;
  std::mutex mutex_;
  std::atomic<bool> started_{false};
  const std::vector<OniVideoMode> modes_;
  OniVideoMode mode_;
  OniBool mirrored_ = TRUE; ///< as a Kinect is when it is switched on
};

/// What happens to a device by itself, which its driver has to tell OpenNI.
class DeviceListener {
public:
  virtual ~DeviceListener() = default;
  virtual void onUnplugAt(int device, int replug_after_ms) = 0;
  virtual void onErrorAt(int device) = 0;
};

/// One opened camera; a thread of its own takes a frame of all started streams at a
/// time.
class Device : public oni::driver::DeviceBase {
public:
  Device(int number, const Settings& settings, DeviceListener& listener)
  : number_(number), settings_(settings), listener_(listener)
  {
    for (const auto& [type, present] : {std::pair(ONI_SENSOR_DEPTH, settings.depth),
                                        std::pair(ONI_SENSOR_COLOR, settings.color)})
      if (present)
        modes_.emplace_back(type, videoModes(type, settings));
    for (auto& [type, modes] : modes_)
      sensors_.push_back({type, static_cast<int>(modes.size()), modes.data()});
    thread_ = std::thread([this] { run(); });
  }

  ~Device() override
  {
    closing_ = true;
    thread_.join();
  }

  OniStatus getSensorInfoList(OniSensorInfo** sensors, int* count) override
  {
    *sensors = sensors_.data();
    *count = static_cast<int>(sensors_.size());
    return ONI_STATUS_OK;
  }

  oni::driver::StreamBase* createStream(OniSensorType type) override
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    streams_.push_back(std::make_shared<Stream>(type, settings_));
    return streams_.back().get();
  }

  void destroyStream(oni::driver::StreamBase* stream) override
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    streams_.erase(
        std::remove_if(streams_.begin(),
                       streams_.end(),
                       [stream](const auto& own) { return own.get() == stream; }),
        streams_.end());
  }

  OniStatus getProperty(int id, void* data, int* size) override
  {
    return id == ONI_DEVICE_PROPERTY_IMAGE_REGISTRATION ?
               answer(registration_, data, size) :
               ONI_STATUS_NOT_SUPPORTED;
  }

  OniStatus setProperty(int id, const void* data, int size) override
  {
    return id == ONI_DEVICE_PROPERTY_IMAGE_REGISTRATION ?
               take(registration_, data, size) :
               ONI_STATUS_NOT_SUPPORTED;
  }

  OniBool isPropertySupported(int id) override
  {
    return id == ONI_DEVICE_PROPERTY_IMAGE_REGISTRATION;
  }

  OniBool isImageRegistrationModeSupported(OniImageRegistrationMode) override
  {
    return TRUE;
  }

  void setSilent(bool silent)
  {
    silent_ = silent;
  }

private:
  void run()
  {
    // Also a camera that is as fast as can be must let others have the mutex.
    constexpr std::chrono::microseconds kPause{100};
    const Clock::duration period =
        settings_.fps > 0 ? Clock::duration(std::chrono::seconds(1)) / settings_.fps :
                            Clock::duration(0);
    auto due = Clock::now();
    while (!closing_) {
      due = std::max(due + period, Clock::now() + kPause);
      std::this_thread::sleep_until(due);
      takeFrame();
    }
  }

  /// The camera takes no frames before a stream is started, so that tests begin with
  /// frame 1. Delivers without our lock: OpenNI2 has locks of its own.
  void takeFrame()
  {
    const auto streams = startedStreams();
    if (streams.empty() || silent_)
      return;
    ++frame_;
    if (frame_ == settings_.stall_at || frame_ == settings_.unplug_at ||
        frame_ == settings_.error_at)
      silent_ = true;
    if (frame_ == settings_.unplug_at)
      listener_.onUnplugAt(number_, settings_.replug_after_ms);
    if (frame_ == settings_.error_at)
      listener_.onErrorAt(number_);
    if (silent_)
      return;
    for (const auto& stream : streams)
      stream->deliver(frame_);
  }

  std::vector<std::shared_ptr<Stream>> startedStreams()
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    std::vector<std::shared_ptr<Stream>> started;
    for (const auto& stream : streams_)
      if (stream->isStarted())
        started.push_back(stream);
    return started;
  }

  const int number_;
  const Settings settings_;
  DeviceListener& listener_;
  std::vector<std::pair<OniSensorType, std::vector<OniVideoMode>>> modes_;
  std::vector<OniSensorInfo> sensors_;
  OniImageRegistrationMode registration_ = ONI_IMAGE_REGISTRATION_OFF;
  std::mutex mutex_;
  std::vector<std::shared_ptr<Stream>> streams_;
  int frame_ = 0;
  std::atomic<bool> silent_{false};
  std::atomic<bool> closing_{false};
  std::thread thread_;
};

OniDeviceInfo
deviceInfo(int number)
{
  OniDeviceInfo info = {};
  std::snprintf(info.uri, sizeof(info.uri), "virtual://%d", number);
  std::snprintf(info.vendor, sizeof(info.vendor), "Holdfast");
  std::snprintf(info.name, sizeof(info.name), "Virtual Kinect");
  info.usbVendorId = 0x1d27;
  info.usbProductId = 0x0600;
  return info;
}

class Driver : public oni::driver::DriverBase, private DeviceListener {
public:
  explicit Driver(OniDriverServices* services) : DriverBase(services)
  {
    instance = this;
  }

  OniStatus initialize(oni::driver::DeviceConnectedCallback connected,
                       oni::driver::DeviceDisconnectedCallback disconnected,
                       oni::driver::DeviceStateChangedCallback changed,
                       void* cookie) override
  {
    DriverBase::initialize(connected, disconnected, changed, cookie);
    setPresent(0, true);
    const char* orders = std::getenv("VIRTUAL_KINECT");
    std::istringstream in(orders != nullptr ? orders : "");
    for (std::string order; std::getline(in, order, ';');)
      obey(order);
    return ONI_STATUS_OK;
  }

  oni::driver::DeviceBase* deviceOpen(const char* uri, const char*) override
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    for (const int number : present_)
      if (std::strcmp(deviceInfo(number).uri, uri) == 0)
        return open_[number] = new Device(number, settings_, *this);
    return nullptr;
  }

  void deviceClose(oni::driver::DeviceBase* device) override
  {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      for (auto& [number, open] : open_)
        if (open == device)
          open = nullptr;
    }
    // Joins a thread that may be waiting for the mutex.
    delete device;
  }

  void shutdown() override {}

  void obey(const std::string& order)
  {
    std::istringstream in(order);
    std::string verb;
    int value = -1;
    if (!(in >> verb) || !(in >> value) ||
        (!configure(verb, value) && !act(verb, value))) {
      std::fprintf(stderr, "virtual Kinect: unknown order '%s'\n", order.c_str());
      std::abort();
    }
  }

  static Driver* instance;

private:
  bool configure(const std::string& verb, int value)
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    const std::map<std::string, int*> numbers = {
        {"fps", &settings_.fps},
        {"unplug_at", &settings_.unplug_at},
        {"replug_after_ms", &settings_.replug_after_ms},
        {"stall_at", &settings_.stall_at},
        {"error_at", &settings_.error_at}};
    const std::map<std::string, bool*> switches = {
        {"color", &settings_.color},
        {"depth", &settings_.depth},
        {"rgb", &settings_.rgb},
        {"start_fails", &settings_.start_fails},
        {"mirror_sticks", &settings_.mirror_sticks}};
    if (const auto found = numbers.find(verb); found != numbers.end())
      *found->second = value;
    else if (const auto flag = switches.find(verb); flag != switches.end())
      *flag->second = value != 0;
    else
      return false;
    return true;
  }

  bool act(const std::string& verb, int value)
  {
    if (verb == "devices") {
      constexpr int kMost = 8;
      for (int number = 0; number < kMost; ++number)
        setPresent(number, number < value);
    }
    else if (verb == "unplug" || verb == "plug")
      setPresent(value, verb == "plug");
    else if (verb == "stall" || verb == "resume")
      setSilent(value, verb == "stall");
    else if (verb == "error" || verb == "recover") {
      setSilent(value, verb == "error");
      setState(value, verb == "error" ? ONI_DEVICE_STATE_ERROR : ONI_DEVICE_STATE_OK);
    }
    else
      return false;
    return true;
  }

  /// OpenNI is told without our lock: it has locks of its own.
  void setPresent(int number, bool present)
  {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      if ((present_.count(number) != 0) == present)
        return;
      if (present)
        present_.insert(number);
      else
        present_.erase(number);
    }
    if (!present)
      setSilent(number, true);
    const OniDeviceInfo info = deviceInfo(number);
    if (present)
      deviceConnected(&info);
    else
      deviceDisconnected(&info);
  }

  void setSilent(int number, bool silent)
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (Device* device = open_[number])
      device->setSilent(silent);
  }

  void setState(int number, int state)
  {
    const OniDeviceInfo info = deviceInfo(number);
    deviceStateChanged(&info, state);
  }

  void onUnplugAt(int number, int pause_ms) override
  {
    // A thread of its own, as a USB stack has: this one holds locks of the device.
    std::thread([this, number, pause_ms] {
      setPresent(number, false);
      if (pause_ms == 0)
        return;
      std::this_thread::sleep_for(std::chrono::milliseconds(pause_ms));
      setPresent(number, true);
    }).detach();
  }

  void onErrorAt(int number) override
  {
    std::thread([this, number] { setState(number, ONI_DEVICE_STATE_ERROR); }).detach();
  }

  std::mutex mutex_;
  Settings settings_;
  std::set<int> present_;
  std::map<int, Device*> open_;
};

Driver* Driver::instance = nullptr;

} // namespace

void
command(const char* order)
{
  if (Driver::instance == nullptr) {
    std::fprintf(stderr, "virtual Kinect: OpenNI has not loaded the driver\n");
    std::abort();
  }
  Driver::instance->obey(order);
}

} // namespace virtual_kinect

ONI_EXPORT_DRIVER(virtual_kinect::Driver)
