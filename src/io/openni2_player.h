/// \file Plays .oni recordings.
#pragma once

#include "openni2_file.h"
#include "openni2_source.h"

#include <fstream>

namespace holdfast::io {

class OniPlayer : public FrameSource {
public:
  /// \throw pcl::IOException
  OniPlayer(const std::string& path, const Openni2Options& options);

  /// From the beginning.
  void start() override;
  void stop() override {}
  Status status() const override;
  Image read(std::chrono::milliseconds timeout) override;
  std::shared_ptr<void> recordTo(const std::string& path) override;

private:
  bool isOvertaken(std::size_t frame) const;
  Image decode(const OniFrame& frame);

  const Playback playback_;
  const OniFile file_;
  /// Of each frame, from the start.
  const std::vector<std::chrono::microseconds> due_;
  std::ifstream in_;
  std::chrono::steady_clock::time_point started_;
  std::size_t next_ = 0; ///< of the frames in the file
};

} // namespace holdfast::io
