#include "openni2_device.h"

#include "openni2_frames.h"
#include "openni2_runtime.h"

#include <fmt/core.h>

#include <fstream>

namespace holdfast::io {

namespace {

std::string
describe(const openni::VideoMode& mode)
{
  return fmt::format("{} x {} at {} Hz",
                     mode.getResolutionX(),
                     mode.getResolutionY(),
                     mode.getFps());
}

bool
isDepthFormat(openni::PixelFormat format)
{
  return format == openni::PIXEL_FORMAT_DEPTH_1_MM ||
         format == openni::PIXEL_FORMAT_DEPTH_100_UM;
}

openni::VideoMode
chooseDepthMode(const openni::SensorInfo& sensor, const Openni2Options& options)
{
  std::string available;
  const auto& modes = sensor.getSupportedVideoModes();
  for (int i = 0; i < modes.getSize(); ++i) {
    if (!isDepthFormat(modes[i].getPixelFormat()))
      continue;
    if (modes[i].getResolutionX() == options.width &&
        modes[i].getResolutionY() == options.height &&
        modes[i].getFps() == options.frames_per_second)
      return modes[i];
    available += (available.empty() ? "" : ", ") + describe(modes[i]);
  }
  openni::VideoMode wanted;
  wanted.setResolution(options.width, options.height);
  wanted.setFps(options.frames_per_second);
  throw Openni2Error(fmt::format("the camera has no depth images of {}, but {}",
                                 describe(wanted),
                                 available));
}

/// Turns mirroring off; true if the stream does it all the same.
bool
remainsMirrored(openni::VideoStream& stream)
{
  if (stream.getMirroringEnabled())
    stream.setMirroringEnabled(false);
  return stream.getMirroringEnabled();
}

/// The same of cropping.
bool
remainsCropped(openni::VideoStream& stream)
{
  int x = 0, y = 0, width = 0, height = 0;
  if (stream.getCropping(&x, &y, &width, &height))
    stream.resetCropping();
  return stream.getCropping(&x, &y, &width, &height);
}

/// An image that keeps the frame, whose pixels it shows.
Image
imageOf(const openni::VideoFrameRef& frame, bool is_mirrored)
{
  Image image;
  image.is_depth = frame.getSensorType() == openni::SENSOR_DEPTH;
  const auto owner = std::make_shared<const openni::VideoFrameRef>(frame);
  image.pixels = {owner, static_cast<const char*>(owner->getData())};
  image.is_mirrored = is_mirrored;
  image.width = frame.getWidth();
  image.height = frame.getHeight();
  image.stride = static_cast<std::size_t>(frame.getStrideInBytes());
  image.metres_per_unit =
      frame.getVideoMode().getPixelFormat() == openni::PIXEL_FORMAT_DEPTH_100_UM ?
          1e-4 :
          1e-3;
  image.timestamp_us = frame.getTimestamp();
  image.index = frame.getFrameIndex();
  image.received = std::chrono::steady_clock::now();
  const int row_bytes = image.width * (image.is_depth ? 2 : 3);
  if (frame.getStrideInBytes() < row_bytes ||
      frame.getDataSize() < (image.height - 1) * frame.getStrideInBytes() + row_bytes)
    throw Openni2Error("an image is incomplete");
  return image;
}

/// The depth codec of OpenNI2 works in a table that all its recorders share.
std::atomic<bool> is_recording_somewhere{false};

} // namespace

Openni2Device::Openni2Device(const std::string& uri, const Openni2Options& options)
: uri_(uri)
{
  callOpenni2([&] {
    try {
      open(options);
    }
    catch (...) {
      close();
      throw;
    }
  });
}

Openni2Device::~Openni2Device()
{
  callOpenni2([this] { close(); });
}

void
Openni2Device::close()
{
  openni::OpenNI::removeDeviceStateChangedListener(this);
  openni::OpenNI::removeDeviceDisconnectedListener(this);
  stopStreams();
  color_.destroy();
  depth_.destroy();
  device_.close();
}

void
Openni2Device::onDeviceDisconnected(const openni::DeviceInfo* device)
{
  if (uri_ == device->getUri())
    status_ = Status::Unplugged;
}

void
Openni2Device::onDeviceStateChanged(const openni::DeviceInfo* device,
                                    openni::DeviceState state)
{
  if (uri_ == device->getUri() && status_ != Status::Unplugged)
    status_ = state == openni::DEVICE_STATE_OK ? Status::Ready : Status::Error;
}

void
Openni2Device::open(const Openni2Options& options)
{
  initializeOpenni2();
  openni::OpenNI::addDeviceDisconnectedListener(this);
  openni::OpenNI::addDeviceStateChangedListener(this);
  if (device_.open(uri_.c_str()) != openni::STATUS_OK)
    throw Openni2Error("cannot open " + uri_ + lastOpenni2Error());
  openDepth(options);
  if (options.color)
    openColor();
  setRegistration(options.registration);
  const openni::VideoMode mode = depth_.getVideoMode();
  const openni::VideoStream& seen_by = options.registration ? color_ : depth_;
  info_.device = {uri_,
                  device_.getDeviceInfo().getVendor(),
                  device_.getDeviceInfo().getName()};
  info_.camera = chooseCamera(options.camera,
                              mode.getResolutionX(),
                              mode.getResolutionY(),
                              seen_by.getHorizontalFieldOfView(),
                              seen_by.getVerticalFieldOfView());
  info_.frames_per_second = mode.getFps();
  info_.has_color = color_.isValid();
}

void
Openni2Device::openDepth(const Openni2Options& options)
{
  const openni::SensorInfo* sensor = device_.getSensorInfo(openni::SENSOR_DEPTH);
  if (sensor == nullptr)
    throw Openni2Error("the device has no depth sensor");
  if (depth_.create(device_, openni::SENSOR_DEPTH) != openni::STATUS_OK)
    throw Openni2Error("cannot open the depth sensor" + lastOpenni2Error());
  if (depth_.setVideoMode(chooseDepthMode(*sensor, options)) != openni::STATUS_OK)
    throw Openni2Error("cannot set the depth mode" + lastOpenni2Error());
  if (remainsCropped(depth_))
    throw Openni2Error("the depth images are cropped: that is not supported");
  depth_is_mirrored_ = remainsMirrored(depth_);
}

void
Openni2Device::openColor()
{
  const openni::SensorInfo* sensor = device_.getSensorInfo(openni::SENSOR_COLOR);
  if (sensor == nullptr ||
      color_.create(device_, openni::SENSOR_COLOR) != openni::STATUS_OK)
    return;
  openni::VideoMode mode = depth_.getVideoMode();
  mode.setPixelFormat(openni::PIXEL_FORMAT_RGB888);
  color_.setVideoMode(mode);
  const openni::VideoMode actual = color_.getVideoMode();
  if (actual.getPixelFormat() != mode.getPixelFormat() ||
      actual.getResolutionX() != mode.getResolutionX() ||
      actual.getResolutionY() != mode.getResolutionY())
    color_.destroy();
  else
    color_is_mirrored_ = remainsMirrored(color_);
}

void
Openni2Device::setRegistration(bool wanted)
{
  const auto mode = wanted ? openni::IMAGE_REGISTRATION_DEPTH_TO_COLOR :
                             openni::IMAGE_REGISTRATION_OFF;
  const bool done = device_.isImageRegistrationModeSupported(mode) &&
                    device_.setImageRegistrationMode(mode) == openni::STATUS_OK;
  if (wanted && !(done && color_.isValid()))
    throw Openni2Error("the camera cannot register depth to colour" +
                       lastOpenni2Error());
}

void
Openni2Device::start()
{
  callOpenni2([this] {
    if (depth_.start() == openni::STATUS_OK &&
        (!color_.isValid() || color_.start() == openni::STATUS_OK))
      return;
    const std::string reason = lastOpenni2Error();
    stopStreams();
    throw Openni2Error("the device does not start" + reason);
  });
}

void
Openni2Device::stop()
{
  callOpenni2([this] { stopStreams(); });
}

void
Openni2Device::stopStreams()
{
  depth_.stop();
  color_.stop();
}

Image
Openni2Device::read(std::chrono::milliseconds timeout)
{
  openni::VideoStream* streams[] = {&depth_, &color_};
  int ready = -1;
  const openni::Status status =
      openni::OpenNI::waitForAnyStream(streams,
                                       info_.has_color ? 2 : 1,
                                       &ready,
                                       static_cast<int>(timeout.count()));
  if (status == openni::STATUS_TIME_OUT)
    return {};
  openni::VideoFrameRef frame;
  if (status != openni::STATUS_OK ||
      streams[ready]->readFrame(&frame) != openni::STATUS_OK)
    throw Openni2Error("cannot read a frame" + lastOpenni2Error());
  return imageOf(frame, ready == 0 ? depth_is_mirrored_ : color_is_mirrored_);
}

std::shared_ptr<void>
Openni2Device::recordTo(const std::string& path)
{
  if (is_recording_somewhere.exchange(true))
    throw Openni2Error("OpenNI2 can write one recording at a time");
  const std::shared_ptr<openni::Recorder> recorder(
      new openni::Recorder,
      [](openni::Recorder* ended) {
        callOpenni2([ended] { delete ended; }); // waits until all is written
        is_recording_somewhere = false;
      });
  // OpenNI2 crashes on a path that it cannot write to.
  if (!std::ofstream(path, std::ios::binary))
    throw Openni2Error(path + ": cannot be written");
  callOpenni2([&] {
    if (recorder->create(path.c_str()) != openni::STATUS_OK ||
        recorder->attach(depth_) != openni::STATUS_OK ||
        (info_.has_color && recorder->attach(color_) != openni::STATUS_OK) ||
        recorder->start() != openni::STATUS_OK)
      throw Openni2Error(path + ": cannot be recorded to" + lastOpenni2Error());
  });
  return recorder;
}

} // namespace holdfast::io
