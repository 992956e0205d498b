/// \file What the colours of patches in a picture mean.
#pragma once

#include "canvas.h"

#include <holdfast/pcl/patch_extraction.h>

#include <set>
#include <string>
#include <vector>

namespace holdfast::app {

/// A number of a fit that colours can show.
struct Measure {
  std::string name; ///< on the command line
  std::string label; ///< with its unit
  double (*value)(const FitResult&);
};

/// All there are.
const std::vector<Measure>& measures();

/// "elliptic paraboloid".
std::string spacedName(SurfaceType surface);

/// The colour map viridis, dark blue at 0 to yellow at 1: equal steps look equal, also
/// to colour-blind people and in grey.
Rgb viridis(double t);

/// A number beside a scale of colours.
struct ScaleTick {
  double place = 0.0; ///< 0 to 1
  std::string text;
};

/// A bar of colours with its title, two lines of a legend high.
/// \param color of a place from 0 to 1.
void drawScale(Canvas& canvas,
               const Frame& frame,
               const std::string& title,
               const std::vector<ScaleTick>& ticks,
               Rgb (*color)(double),
               const Rgb& text);

/// The colours of patches and their legend.
class PatchColors {
public:
  /// By type of surface, or by a measure. All `patches` share the legend; its scale
  /// is logarithmic and leaves the outer 5 % of their numbers on each side aside.
  /// \param measure null: by type.
  /// \throw std::runtime_error when no patch has a positive number.
  PatchColors(const Measure* measure, const std::vector<ExtractedPatch>& patches);

  Rgb operator()(const FitResult& fit) const;

  /// px, in a picture of that width.
  int legendHeight(int width) const;

  /// \param text the colour of words.
  void drawLegend(Canvas& canvas, const Frame& frame, const Rgb& text) const;

private:
  void drawTypes(Canvas& canvas, const Frame& frame, const Rgb& text) const;
  void drawBar(Canvas& canvas, const Frame& frame, const Rgb& text) const;

  const Measure* measure_;
  std::set<SurfaceType> types_; ///< that there are
  std::vector<double> ticks_; ///< of the scale, end to end
};

} // namespace holdfast::app
