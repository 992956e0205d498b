/// \file What of the patches of an image is shown as images.
#pragma once

#include "render/canvas.h"

#include <holdfast/pcl/dense_extraction.h>

#include <ostream>
#include <string>
#include <vector>

namespace holdfast::app {

/// A number, or three, for every place of an image of patches.
struct Layer {
  /// How a number becomes a colour.
  enum class Colors {
    Axes, ///< three numbers from -1 to 1 as red, green and blue
    Sequence, ///< from zero to the end of the scale
    Balance ///< both ways from the middle of the scale
  };

  std::string name; ///< in that of its file
  std::string label; ///< with its unit
  Colors colors = Colors::Sequence;
  int channels = 1;
  std::vector<float> values; ///< row by row; NaN where there is no patch
  /// The same for people, in their units; empty: as they are.
  std::vector<float> shown;
  double middle = 0.0; ///< of the scale, where it is shown both ways
};

/// In the order of writeDenseFiles().
std::vector<Layer> layersOf(const DenseExtraction& dense, const Pose& sensor_pose);

/// A portable float map: rows from the bottom up, numbers as this computer keeps them,
/// which the file says.
void writePfm(std::ostream& out, const Layer& layer, int width, int height);

/// A picture of the layer with its scale, enlarged by a whole factor if it is small.
Canvas pictureOf(const Layer& layer, int width, int height);

} // namespace holdfast::app
