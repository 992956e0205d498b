/// \file The frames of a noise calibration, cut into tiles of 8 x 8 pixels.
#pragma once

#include "plane_moments.h"

#include <holdfast/sensor/noise_calibration.h>

#include <limits>
#include <vector>

namespace holdfast {

/// Of a pixel without one.
inline constexpr float kUnknownDisparity = std::numeric_limits<float>::quiet_NaN();

inline constexpr int kTileSize = 8; // px

/// Sums over the pixels of one tile that saw the same thing in most frames.
struct Tile {
  bool usable = false;
  double depth_m = 0.0;
  std::vector<PlaneMoments> frames; ///< disparities of each
  PlaneMoments mean; ///< of the mean disparities over the frames
  double inverse_counts = 0.0; ///< sum of 1 / number of frames of a pixel
  double temporal = 0.0; ///< sum of squared deviations from the pixel's mean, px^2
  double temporal_dof = 0.0;
  double scatter = 0.0; ///< sum of squared deviations from the ray grid, px^2
  double scatter_dof = 0.0;
};

/// The image is cut into so many cells, whose tiles are left out together where an
/// interval is wanted: the pattern of neighbouring pixels is not independent.
inline constexpr int kCellColumns = 8;
inline constexpr int kCellRows = 6;

/// Larger ones where waves of some 60 px are to be told, which reach across the others.
inline constexpr int kPatternColumns = 4;
inline constexpr int kPatternRows = 3;

struct TileImage {
  int columns = 0;
  int rows = 0;
  std::vector<Tile> tiles; ///< row by row

  const Tile& operator[](int index) const
  {
    return tiles[static_cast<std::size_t>(index)];
  }

  int index(int column, int row) const
  {
    return row * columns + column;
  }

  /// Number of the cell of a tile, row by row.
  int cellOf(int index) const
  {
    return cellOf(index, kCellColumns, kCellRows);
  }

  /// The same for larger cells.
  int patternCellOf(int index) const
  {
    return cellOf(index, kPatternColumns, kPatternRows);
  }

private:
  int cellOf(int index, int cell_columns, int cell_rows) const
  {
    return index / columns * cell_rows / rows * cell_columns +
           index % columns * cell_columns / columns;
  }
};

/// Disparities by pixel and frame, the tiles made from them, and which of these are
/// usable: three quarters of their pixels there, and their noise not out of proportion.
class DisparityStack {
public:
  /// Leaves out what single frames saw differently. Pixels without enough frames: none.
  DisparityStack(const std::vector<PointImage>& frames,
                 const NoiseCalibrationOptions& options);

  int width() const
  {
    return width_;
  }

  int height() const
  {
    return height_;
  }

  int frames() const
  {
    return static_cast<int>(frames_.size());
  }

  /// px; NaN where there is none.
  float disparity(int frame, int u, int v) const
  {
    return frames_[static_cast<std::size_t>(frame)]
                  [static_cast<std::size_t>(v * width_ + u)];
  }

  TileImage tiles(const std::vector<PointImage>& frames,
                  const NoiseCalibrationOptions& options) const;

private:
  /// The values of one pixel that are there.
  struct Spread {
    int count = 0;
    double mean = 0.0;
    double squares = 0.0; ///< sum of squared deviations from the mean
  };

  Spread spreadOf(int u, int v) const;
  float typicalChange() const;
  void dropWhatMoved();
  void addPixel(int u, int v, Tile& tile) const;
  void addScatter(const PointImage& image,
                  int column,
                  int row,
                  double focal_px,
                  Tile& tile) const;

  int width_;
  int height_;
  std::vector<std::vector<float>> frames_;
};

} // namespace holdfast
