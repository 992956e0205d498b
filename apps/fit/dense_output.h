/// \file An image of patches as files.
#pragma once

#include <holdfast/pcl/dense_extraction.h>

#include <string>

namespace holdfast::app {

/// What becomes of an image of patches: where it is written, and what it is of.
struct DenseReport {
  std::string cloud; ///< file
  Pose sensor_pose;
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();
  DenseExtraction dense;
};

/// Writes STEM.dense.pcd, the attempts as an organized cloud of PatchPoint, and five
/// layers of the same size: normal (in the frame of the cloud), kappa_min and kappa_max
/// (1/m), sigma_normal (rad), chi2_ratio. Each is there twice: STEM.LAYER.pfm, floats,
/// NaN where there is no patch, and STEM.LAYER.png, colours for people with their
/// scale; normals are shown in the frame of the camera. All files appear, or none.
/// \throw std::runtime_error "FILE: cause".
void writeDenseFiles(const DenseReport& report,
                     const std::string& folder,
                     const std::string& stem);

/// "320 x 240 attempts, every 2 pixels: 61034 patches (79 %), too_few_points 912, ...".
std::string denseSummary(const DenseReport& report, double load_ms, double fit_ms);

} // namespace holdfast::app
