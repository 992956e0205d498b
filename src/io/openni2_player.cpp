#include "openni2_player.h"

#include "openni2_frames.h"
#include "openni2_runtime.h"

#include <fmt/core.h>

#include <algorithm>
#include <thread>
#include <utility>

namespace holdfast::io {

namespace {

using Clock = std::chrono::steady_clock;

/// Decoded pixels as an image holds them.
template <typename Pixel>
std::shared_ptr<const char>
share(std::vector<Pixel> pixels)
{
  const auto owner = std::make_shared<const std::vector<Pixel>>(std::move(pixels));
  return {owner, reinterpret_cast<const char*>(owner->data())};
}

/// When frames are due at recorded speed. Long gaps, as damage makes them, are
/// shortened.
std::vector<std::chrono::microseconds>
dueTimes(const std::vector<OniFrame>& frames)
{
  constexpr std::uint64_t kLongestGapUs = 2000000;
  std::vector<std::chrono::microseconds> due;
  std::uint64_t latest = frames.front().timestamp_us;
  std::uint64_t time = 0;
  for (const OniFrame& frame : frames) {
    if (frame.timestamp_us > latest)
      time += std::min(frame.timestamp_us - latest, kLongestGapUs);
    latest = std::max(latest, frame.timestamp_us);
    due.emplace_back(time);
  }
  return due;
}

} // namespace

OniPlayer::OniPlayer(const std::string& path, const Openni2Options& options)
: playback_(options.playback)
, file_(readOniFile(path))
, due_(dueTimes(file_.frames))
, in_(path, std::ios::binary)
{
  if (options.registration)
    throw Openni2Error(path + ": depth is as it was recorded, and cannot be registered "
                              "to colour now");
  info_.device.uri = path;
  info_.camera = chooseCamera(options.camera,
                              file_.depth.width,
                              file_.depth.height,
                              file_.depth.horizontal_fov,
                              file_.depth.vertical_fov);
  info_.frames_per_second = file_.depth.frames_per_second;
  info_.has_color = options.color && file_.color;
  info_.is_recording = true;
  info_.is_cut_off = !file_.is_closed;
}

void
OniPlayer::start()
{
  started_ = Clock::now();
  next_ = 0;
}

FrameSource::Status
OniPlayer::status() const
{
  return next_ < file_.frames.size() ? Status::Ready : Status::Ended;
}

Image
OniPlayer::read(std::chrono::milliseconds timeout)
{
  while (next_ < file_.frames.size() &&
         ((!info_.has_color && !file_.frames[next_].is_depth) || isOvertaken(next_)))
    ++next_;
  if (next_ == file_.frames.size())
    return {};
  if (playback_ == Playback::RecordedSpeed) {
    const auto due = started_ + due_[next_];
    const auto limit = Clock::now() + timeout;
    std::this_thread::sleep_until(std::min(due, limit));
    if (due > limit)
      return {};
  }
  return decode(file_.frames[next_++]);
}

/// Whether a newer image of the same camera is due, too.
bool
OniPlayer::isOvertaken(std::size_t frame) const
{
  if (playback_ == Playback::EveryFrame)
    return false;
  std::size_t newer = frame + 1;
  while (newer < file_.frames.size() &&
         file_.frames[newer].is_depth != file_.frames[frame].is_depth)
    ++newer;
  return newer < file_.frames.size() && started_ + due_[newer] <= Clock::now();
}

Image
OniPlayer::decode(const OniFrame& frame)
{
  std::vector<std::uint8_t> data(frame.bytes);
  in_.seekg(static_cast<std::streamoff>(frame.position));
  if (!in_.read(reinterpret_cast<char*>(data.data()), frame.bytes))
    throw Openni2Error(info_.device.uri + " cannot be read any more");
  const OniStream& stream = frame.is_depth ? file_.depth : *file_.color;
  Image image;
  try {
    image.pixels = frame.is_depth ? share(decodeDepth(stream, data)) :
                                    share(decodeColor(stream, data));
  }
  catch (const Openni2Error& error) {
    throw Openni2Error(
        fmt::format("{}, image {}: {}", info_.device.uri, frame.number, error.what()));
  }
  image.is_depth = frame.is_depth;
  image.is_mirrored = stream.is_mirrored;
  image.width = stream.width;
  image.height = stream.height;
  image.stride = static_cast<std::size_t>(stream.width) * (frame.is_depth ? 2 : 3);
  image.metres_per_unit = stream.metres_per_unit;
  image.timestamp_us = frame.timestamp_us;
  image.index = frame.number;
  image.received = Clock::now();
  return image;
}

std::shared_ptr<void>
OniPlayer::recordTo(const std::string&)
{
  throw Openni2Error("there is no camera to record");
}

} // namespace holdfast::io
