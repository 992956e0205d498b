/// \file Results of `holdfast risk`, as pictures and pages show them.
#pragma once

#include <holdfast/contact/foothold.h>
#include <holdfast/io/cloud_io.h>
#include <holdfast/pcl/patch_extraction.h>

#include <nlohmann/json.hpp>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace holdfast::app {

/// A patch, and what came of the foot on it.
struct TriedPatch {
  std::uint64_t id = 0; ///< in the map
  ContactStatus status = ContactStatus::InsufficientSupport;
  std::optional<double> total; ///< risk; nothing without enough support
  /// Frame of the points; of the fit no more than shape and status, which is not usable
  /// where the map knows too little of the patch.
  ExtractedPatch patch;
};

/// A sole where a foothold has it.
struct PictureSole {
  std::vector<Eigen::Vector3d> corners; ///< frame of the points, m
  Eigen::Vector3d middle = Eigen::Vector3d::Zero(); ///< of the corners
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ(); ///< out of the surface
  Eigen::Vector3d toe = Eigen::Vector3d::Zero(); ///< where its x axis leaves it
  double total = 1.0; ///< its risk
};

struct RiskResult {
  std::string source; ///< file
  bool is_of_map = false; ///< else of a cloud
  std::optional<CloudFileInfo> file; ///< how that was read; not of a map
  Pose sensor_pose; ///< at the last frame, in the frame of the points
  Eigen::Vector3d offset = Eigen::Vector3d::Zero(); ///< PatchReport::offset
  double radius_m = 0.0; ///< of the patches
  std::vector<TriedPatch> patches; ///< all of them
  /// Best first, all with their quality; of the placement the yaw is known.
  std::vector<Foothold> footholds;
  std::vector<PictureSole> soles; ///< one for each foothold
  nlohmann::json head; ///< the members of its JSON but for its lists
};

/// Whether a text looks like such a result.
bool isRiskResult(const std::string& text);

/// \throw std::runtime_error when the text is no such result.
RiskResult readRiskResult(const std::string& text);

} // namespace holdfast::app
