/// \file Contact risk as layers of a grid, as grid_map_msgs/GridMap has them.
///
/// A converter copies: info.resolution, length_x, length_y and pose.position from
/// RiskGrid::info; `layers` and `basic_layers` as they are; each layer's values into
/// one Float32MultiArray whose layout is
///
///     dim[0] = {label "column_index", size columns, stride rows * columns}
///     dim[1] = {label "row_index",    size rows,    stride rows}
///
/// with data_offset 0; outer_start_index and inner_start_index. Cell (0, 0) is the one
/// of largest x and largest y: rows run against x, columns against y, and a column's
/// values follow each other. grid_map takes a grid's axes for those of its frame_id and
/// leaves the orientation of the pose aside: where RiskGrid::Info::axes is no identity
/// (the load is not along -z of the map) the grid wants a frame of its own, which is
/// turned by it.
#pragma once

#include <holdfast/contact/contact_risk.h>

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace holdfast {

/// A rectangle of the grid's xy plane, m.
struct GridBounds {
  Eigen::Vector2d low = Eigen::Vector2d::Zero();
  Eigen::Vector2d high = Eigen::Vector2d::Zero();
};

struct RiskGridOptions {
  double resolution_m = 0.02; ///< side of a cell
  int yaws = 8; ///< that are tried in every cell, over a full turn
  Eigen::Vector3d load_direction = -Eigen::Vector3d::UnitZ(); ///< frame of the map
  std::optional<GridBounds> bounds; ///< none: what the map has seen
  int threads = 1; ///< 0: one per core
};

/// Empty when the options make sense, else one sentence.
std::string validityError(const RiskGridOptions& options);

/// In the order of RiskGrid::layers. All lengths in m, frame of the grid:
/// elevation and its sigma along z, against the load; the unit normal; the largest
/// sigma of the slope in any direction; principal curvatures, 1/m; risks at the best
/// yaw, and that yaw of the sole's x axis about z, rad; expected contact area, m^2.
enum class RiskLayer : std::uint8_t {
  Elevation,
  ElevationSigma,
  NormalX,
  NormalY,
  NormalZ,
  SlopeSigma,
  CurvatureMin,
  CurvatureMax,
  RiskSlip,
  RiskGap,
  RiskSupport,
  RiskTotal,
  ContactArea,
  YawBest
};

inline constexpr std::array<std::string_view, 14> kRiskLayerNames{"elevation",
                                                                  "elevation_sigma",
                                                                  "normal_x",
                                                                  "normal_y",
                                                                  "normal_z",
                                                                  "slope_sigma",
                                                                  "curvature_min",
                                                                  "curvature_max",
                                                                  "risk_slip",
                                                                  "risk_gap",
                                                                  "risk_support",
                                                                  "risk_total",
                                                                  "contact_area",
                                                                  "yaw_best"};

struct RiskGrid {
  struct Info {
    double resolution_m = 0.0;
    double length_x_m = 0.0; ///< rows * resolution
    double length_y_m = 0.0; ///< columns * resolution
    /// Of the grid's middle, in the axes of the grid and from the map's origin; z is 0.
    Eigen::Vector3d position = Eigen::Vector3d::Zero();
    /// Axes of the grid as columns, frame of the map: z against the load, and the
    /// identity where that is z.
    Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();
  };

  Info info;
  std::vector<std::string> layers; ///< kRiskLayerNames
  std::vector<std::string> basic_layers; ///< what a cell needs to be valid: elevation
  int rows = 0; ///< along x
  int columns = 0; ///< along y
  /// One for each layer, rows * columns values column by column. NaN: no surface was
  /// seen there; of the risks but risk_support, too little of it under the sole; of
  /// yaw_best and contact_area likewise.
  std::vector<std::vector<float>> data;
  std::uint16_t outer_start_index = 0;
  std::uint16_t inner_start_index = 0;

  float at(RiskLayer layer, int row, int column) const
  {
    return data[static_cast<std::size_t>(layer)]
               [static_cast<std::size_t>(column * rows + row)];
  }

  /// Middle of a cell in the axes of the grid, m.
  Eigen::Vector2d position(int row, int column) const;

  /// The same on the surface, frame of the map; NaN where there is none.
  Eigen::Vector3d point(int row, int column) const;
};

/// More of them would be a wrong resolution: at 1 cm they are a square of 32 m.
constexpr int kMaxRiskGridCells = 10'000'000;

/// The risk of putting the foot in the middle of every cell. Where patches lie above
/// each other, that which the load meets first counts; where they overlap, that whose
/// anchor is nearest. The result does not depend on the number of threads.
/// \throw std::invalid_argument when foot or options make no sense, or the grid would
/// have more than kMaxRiskGridCells.
RiskGrid riskGrid(const PatchMap& map,
                  const Foot& foot,
                  const RiskGridOptions& options = {});

} // namespace holdfast
