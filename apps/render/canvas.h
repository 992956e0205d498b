/// \file A picture drawn in software: depth-tested, anti-aliased, written as PNG.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <ostream>
#include <vector>

namespace holdfast::app {

/// Red green blue.
using Rgb = std::array<std::uint8_t, 3>;

/// Every channel times `factor` >= 0, at most white.
Rgb scaled(const Rgb& color, double factor);

/// Nearness of what is drawn over everything else.
inline constexpr double kInFront = std::numeric_limits<double>::infinity();

/// A place in the picture: px to the right and down from the top left corner of the
/// first pixel. The larger nearness hides the smaller; between points it is linear in x
/// and y, as 1/depth is in a perspective view and -depth in an orthographic one.
struct ScreenPoint {
  double x = 0.0;
  double y = 0.0;
  double nearness = kInFront;
};

/// A rectangle of whole pixels; the right and bottom ends are outside.
struct Frame {
  int left = 0;
  int top = 0;
  int right = 0;
  int bottom = 0;

  int width() const
  {
    return right - left;
  }
  int height() const
  {
    return bottom - top;
  }
};

/// Every pixel is the mean of nine samples with a depth of their own, so all edges come
/// out smooth. What is opaque hides what lies behind it; what is translucent is
/// hidden, but hides nothing.
class Canvas {
public:
  Canvas(int width, int height, const Rgb& background);

  /// The whole picture.
  Frame frame() const
  {
    return {0, 0, width_, height_};
  }

  /// Drawing changes nothing outside `frame` from now on.
  void clip(const Frame& frame);

  void drawDisc(const ScreenPoint& center, double radius, const Rgb& color);

  /// With round ends; a disc where both are the same.
  void drawLine(const ScreenPoint& from,
                const ScreenPoint& to,
                double width,
                const Rgb& color);

  /// \param opacity 0 to 1.
  void drawTriangle(const std::array<ScreenPoint, 3>& corners,
                    const Rgb& color,
                    double opacity = 1.0);

  /// Over everything else.
  void drawRectangle(const Frame& frame, const Rgb& color);

  /// Mean over the samples of a pixel that something covers; minus infinity when none
  /// is.
  double nearness(int column, int row) const;

  /// Multiplies the colours of the samples that something covers, and sets their
  /// nearness.
  void finish(int column, int row, double factor, double nearness);

  /// 8 bits per channel. \throw std::runtime_error with the cause.
  void writePng(std::ostream& out) const;

private:
  struct Box {
    double left, top, right, bottom;
  };
  template <typename NearnessAt>
  void fill(const Box& box,
            const NearnessAt& nearnessAt,
            const Rgb& color,
            double opacity = 1.0);
  template <typename Visit>
  void visitSamples(int column, int row, const Visit& visit) const;

  int width_;
  int height_;
  Frame clip_;
  std::vector<Rgb> colors_; ///< of the samples, row by row
  std::vector<float> nearness_; ///< of the same; minus infinity: background
};

} // namespace holdfast::app
