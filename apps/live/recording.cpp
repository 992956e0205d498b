#include "recording.h"

#include <filesystem>

namespace holdfast {

bool
isOniPath(const std::string& path)
{
  return std::filesystem::path(path).extension() == ".oni";
}

Recording::Recording(Openni2Grabber& grabber,
                     const std::string& path,
                     Playback playback)
: grabber_(grabber)
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

} // namespace holdfast
