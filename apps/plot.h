/// \file Plots as SVG files.
#pragma once

#include <ostream>
#include <string>
#include <vector>

namespace holdfast::app {

struct Axis {
  std::string label; ///< with its unit
  bool logarithmic = false;
  bool downwards = false; ///< y axis of an image
  /// Names of 0, 1, 2, ... instead of numbers.
  std::vector<std::string> categories = {};
};

enum class SeriesStyle { Line, DashedLine, Markers, Dots, Polygon };

/// Data in the units of the axes. What cannot be drawn, such as zero on a logarithmic
/// axis, leaves a gap.
struct Series {
  /// Shown in the legend; series of one name share a colour. Empty: grey, and not in
  /// the legend.
  std::string name;
  std::vector<double> x;
  std::vector<double> y;
  SeriesStyle style = SeriesStyle::Line;
  /// A band about the line, if not empty.
  std::vector<double> low = {};
  std::vector<double> high = {};
};

struct Panel {
  std::string title;
  Axis x;
  Axis y;
  bool equal_scales = false; ///< one unit of x as long as one of y
  std::vector<Series> series;
};

struct Plot {
  std::vector<Panel> panels;
  int columns = 1;
};

/// Writes the panels row by row below one legend.
/// \param description goes into the file as its <desc>.
void writeSvg(std::ostream& out, const Plot& plot, const std::string& description);

} // namespace holdfast::app
