/// \file Results and the clouds they are about, as pictures and pages show them.
#pragma once

#include "input_options.h"

#include <holdfast/io/patch_io.h>

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace holdfast::app {

/// The finite points of a cloud, to be drawn.
struct PicturePoints {
  std::vector<Eigen::Vector3d> positions; ///< world frame, m
  /// Red, green, blue of each, or empty: the file has none.
  std::vector<std::array<std::uint8_t, 3>> colors;
};

/// A cloud and where it is best looked at from.
struct SeenCloud {
  PicturePoints points;
  Pose sensor_pose;
  bool seen = false; ///< by a camera in that pose
};

/// Two unit vectors at right angles, world frame.
struct Standpoint {
  Eigen::Vector3d front = Eigen::Vector3d::UnitX(); ///< towards the sensor's side
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
};

/// All bytes of a file. \throw std::runtime_error "PATH: cause".
std::string readResultText(const std::string& path);

/// A result with patches that can be drawn; those of a map of which too little is known
/// (their status is not usable) are among them.
/// \param path for messages. \throw std::runtime_error "PATH: cause".
PatchReport parseResult(const std::string& path, const std::string& text);

/// The cloud of a result, which may have moved together with it; nothing when it is
/// neither where its name says nor beside the result.
std::optional<std::string> findCloud(const std::string& result,
                                     const std::string& cloud);

/// Points, and whether a camera in that pose may have seen them: not so for scans from
/// all sides, and clouds whose file does not tell where the sensor stood.
SeenCloud seenFrom(const Pose& sensor_pose, PicturePoints points);

CloudReading readingOf(const PatchReport& report);

/// A cloud, less the pattern map of the sensor, if it has one. Where its file has the
/// name of the result's cloud and the caller says nothing else, it is read and seen as
/// it was for that.
/// \param notices receives a line where that cannot be taken off.
/// \throw std::runtime_error "PATH: cause".
SeenCloud loadSeenCloud(const std::string& path,
                        const InputOptions& input,
                        const CloudReading& of_result,
                        std::vector<std::string>& notices);

/// Up is -y where the cloud is in the frame of its camera, else z.
Standpoint standpointOf(const SeenCloud& cloud);

/// Where to look at a standpoint's scene from: unit vector towards the eye.
/// \param azimuth to the right of the front, rad. \param elevation above it, rad.
Eigen::Vector3d towardsEye(const Standpoint& standpoint,
                           double azimuth,
                           double elevation);

/// At most `count` of the patches, spread evenly over their order.
std::vector<ExtractedPatch> evenShare(const std::vector<ExtractedPatch>& patches,
                                      std::size_t count);

} // namespace holdfast::app
