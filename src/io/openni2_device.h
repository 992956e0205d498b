/// \file A camera, through OpenNI2.
#pragma once

#include "openni2_source.h"

#include <OpenNI.h>

#include <atomic>
#include <chrono>
#include <memory>
#include <string>

namespace holdfast::io {

class Openni2Device : public FrameSource,
                      private openni::OpenNI::DeviceDisconnectedListener,
                      private openni::OpenNI::DeviceStateChangedListener {
public:
  /// \param uri as resolveDevice() gave it. \throw pcl::IOException
  Openni2Device(const std::string& uri, const Openni2Options& options);
  ~Openni2Device() override;
  Openni2Device(const Openni2Device&) = delete;
  Openni2Device& operator=(const Openni2Device&) = delete;

  void start() override;
  void stop() override;
  Status status() const override
  {
    return status_;
  }
  Image read(std::chrono::milliseconds timeout) override;
  std::shared_ptr<void> recordTo(const std::string& path) override;

private:
  // Called by threads of OpenNI2.
  void onDeviceDisconnected(const openni::DeviceInfo* device) override;
  void onDeviceStateChanged(const openni::DeviceInfo* device,
                            openni::DeviceState state) override;

  void open(const Openni2Options& options);
  void openDepth(const Openni2Options& options);
  void openColor();
  void setRegistration(bool wanted);
  void stopStreams();
  void close();

  const std::string uri_;
  std::atomic<Status> status_{Status::Ready};
  bool depth_is_mirrored_ = false;
  bool color_is_mirrored_ = false;
  openni::Device device_;
  openni::VideoStream depth_, color_;
};

} // namespace holdfast::io
