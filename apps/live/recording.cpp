#include "recording.h"

#include <filesystem>
#include <stdexcept>

namespace holdfast::app {
namespace {

/// Some frames and the end of a file.
constexpr std::uintmax_t kEnoughBytes = 20'000'000;

} // namespace

bool
isOniPath(const std::string& path)
{
  return std::filesystem::path(path).extension() == ".oni";
}

Recording::Recording(Openni2Grabber& grabber,
                     const std::string& path,
                     Playback playback)
: grabber_(grabber), path_(path)
{
  if (isOniPath(path))
    grabber_.startRecording(path);
  else
    folder_ = std::make_unique<FrameRecorder>(path, playback == Playback::EveryFrame);
}

void
Recording::push(const RangeFrame::ConstPtr& frame)
{
  if (folder_)
    folder_->push(frame);
}

void
Recording::checkDisk() const
{
  if (folder_)
    return; // which checks every frame
  std::error_code error;
  const auto folder = std::filesystem::absolute(path_).parent_path();
  if (std::filesystem::space(folder, error).available < kEnoughBytes && !error)
    throw std::runtime_error(path_ + ": the disk is full, the recording ends here");
}

void
Recording::finish()
{
  if (folder_)
    folder_->finish();
  else
    grabber_.stopRecording();
}

std::uint64_t
Recording::dropped() const
{
  return folder_ ? folder_->dropped() : 0;
}

} // namespace holdfast::app
