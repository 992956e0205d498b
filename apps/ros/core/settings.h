/// \file What the node is asked to do, and what of it may change while it runs.
#pragma once

#include <holdfast/contact/foothold.h>
#include <holdfast/contact/risk_grid.h>
#include <holdfast/fit/options.h>
#include <holdfast/io/cloud_io.h>

#include <Eigen/Core>

#include <optional>
#include <string>

namespace holdfast::robot {

/// May change between two frames.
struct Tuning {
  /// Of the patches, m; 0: what the foot wants (patchRadiusFor()), else 0.05.
  double radius_m = 0.0;
  /// Of a frame; 0: as many as the cloud gives, as `holdfast fit` does.
  int max_patches = 300;
  double budget_ms = 25.0; ///< start no new patch after this; 0: no limit
  double max_chi2_per_dof = 3.0; ///< ValidationOptions, as the next two
  double min_coverage = 0.5;
  double max_view_angle_deg = 85.0; ///< the same
  double max_curvature_per_m = 0.0; ///< 0: no limit
};

bool operator==(const Tuning& a, const Tuning& b);

/// Empty when it makes sense, else one sentence.
std::string validityError(const Tuning& tuning);

struct Settings {
  std::string sensor = "kinect_v1"; ///< name or file
  bool pattern = true; ///< false: errors of neighbouring pixels are independent
  /// Frame of the sensor, looked up in that of the cloud; empty: the cloud's own.
  std::string sensor_frame;
  CloudAxes axes = CloudAxes::Camera; ///< of that frame
  SurfaceRequest surface = SurfaceRequest::Auto;
  int threads = 0; ///< 0: one per core

  bool map = false;
  /// Frame in which the sensor moves and z is up; empty: there is none, the frames of a
  /// map find their own poses, and the load is along the image's columns.
  std::string odometry_frame;
  std::string map_frame = "holdfast_map"; ///< of a map without odometry
  /// Of the motion from frame to frame, rad and m, beside what its source says.
  double motion_sigma_rad = 1e-3, motion_sigma_m = 1e-3;

  std::string foot; ///< name or file; empty: no risk
  /// In the odometry frame or, without, that of the patches; none: what that tells.
  std::optional<Eigen::Vector3d> load_direction;
  double grid_resolution_m = 0.02;
  int yaws = 8;
  double foothold_spacing_m = 0.1;
  int max_footholds = 100;
};

/// Empty when it makes sense, but for names that are still to be read; else one
/// sentence.
std::string validityError(const Settings& settings);

/// The options that a node's settings say, the load along -z unless they name one.
FootholdOptions footholdOptions(const Settings& settings);
RiskGridOptions gridOptions(const Settings& settings);

} // namespace holdfast::robot
