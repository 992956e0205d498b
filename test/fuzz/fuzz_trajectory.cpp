/// \file Trajectories of any bytes.
#include "fuzz.h"
#include <holdfast/io/trajectory_file.h>

int
LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
  using namespace holdfast;
  using fuzz::require;
  static const fuzz::MemoryFile file;
  try {
    const auto poses = readTrajectory(file.hold(data, size));
    require(!poses.empty(), "a trajectory has a pose");
    for (std::size_t i = 0; i < poses.size(); ++i) {
      require(i == 0 || poses[i].stamp_s > poses[i - 1].stamp_s, "time goes on");
      require(poses[i].pose.c.allFinite(), "positions are finite");
      require(poses[i].pose.R.isUnitary(1e-12), "rotations are rotations");
    }
    require(doubtAbout(poses).find('\n') == std::string::npos, "a doubt is one line");
    require(poseAt(poses, poses.back().stamp_s, 0.0).has_value(),
            "there is a pose at a stamp");
  }
  catch (const std::runtime_error& error) {
    fuzz::requireOneLine(error);
  }
  return 0;
}
