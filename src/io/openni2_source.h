/// \file What delivers images: a camera, or a recording of one.
#pragma once

#include <holdfast/io/openni2_grabber.h>

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

namespace holdfast::io {

/// An image of the depth or the colour camera.
struct Image {
  /// Rows of 16-bit depths, or of red, green and blue; null: no image.
  std::shared_ptr<const char> pixels;
  bool is_depth = false;
  bool is_mirrored = false; ///< columns from right to left
  int width = 0;
  int height = 0;
  std::size_t stride = 0; ///< bytes from row to row
  double metres_per_unit = 0.0; ///< of depths
  std::uint64_t timestamp_us = 0;
  int index = 0;
  std::chrono::steady_clock::time_point received;
};

struct SourceInfo {
  Openni2DeviceInfo device;
  Camera camera; ///< of the depth images
  int frames_per_second = 0;
  bool has_color = false;
  bool is_recording = false;
  bool is_cut_off = false; ///< a recording that its writer did not close
};

class FrameSource {
public:
  enum class Status { Ready, Unplugged, Error, Ended };

  virtual ~FrameSource() = default;

  /// \throw pcl::IOException
  virtual void start() = 0;
  virtual void stop() = 0;
  virtual Status status() const = 0;

  /// The next image of either camera, none when none came in this time.
  /// \throw pcl::IOException when it cannot be read.
  virtual Image read(std::chrono::milliseconds timeout) = 0;

  /// From now on all images go into this file, too, until what is returned is
  /// destroyed. \throw pcl::IOException
  virtual std::shared_ptr<void> recordTo(const std::string& path) = 0;

  const SourceInfo& info() const
  {
    return info_;
  }

protected:
  SourceInfo info_;
};

} // namespace holdfast::io
