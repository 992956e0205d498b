#include "stroke_font.h"

#include <algorithm>
#include <array>
#include <string_view>
#include <vector>

namespace holdfast::app {
namespace {

// Glyphs from ' ' to '~'. Strokes are separated by blanks; a point is a digit, x, and a
// letter, y: 'd' is the foot, 'j' the height of small letters, 'm' that of capitals and
// digits, 'a' where g and p end. A stroke is a quadratic B-spline that starts and ends
// in its outermost points; a point given twice is a corner.
constexpr std::array<std::string_view, 95> kGlyphs{
    "", // space
    "0m0g 0d0d", // !
    "0m0k 2m2k", // "
    "1d2m 4d5m 0g6g 0j6j", // #
    "6k6m0m0i6i6d0d0f 3n3c", // $
    "0d6m 0l0m2m2k0k0l 4e4f6f6d4d4e", // %
    "6d1j1m4m4j0g0d4d6h", // &
    "0m0k", // '
    "2n0k0e2b", // (
    "0n2k2e0b", // )
    "2m2i 0l4j 0j4l", // *
    "0g4g 2e2i", // +
    "1d0b", // ,
    "0g3g", // -
    "0d0d", // .
    "0c4n", // /
    "0i0m5m5d0d0i", // 0
    "0k2m2m2d", // 1
    "0k0m5m5i0d0d5d", // 2
    "0k0m5m5i2i 2i5i5d0d0f", // 3
    "4d4m4m0g0g5g", // 4
    "5m1m1m0i0i1j5j5d0d0f", // 5
    "5l5m0m0d5d5i0i0g", // 6
    "0m5m5m2d", // 7
    "0k0m5m5i0i0k 0f0i5i5d0d0f", // 8
    "0e0d5d5m0m0h5h5j", // 9
    "0d0d 0i0i", // :
    "1d0b 1i1i", // ;
    "4j0g0g4d", // <
    "0f4f 0h4h", // =
    "0j4g4g0d", // >
    "0k0m4m4i2h2g2g2f 2d2d", // ?
    "6i6j2j2f6f6i 6i6f8f8m0m0d7d", // @
    "0d3m3m6d 1g5g", // A
    "0d0m0m3m3m5m5i3i3i0i 3i6i6d3d3d0d", // B
    "6k6m0m0d6d6f", // C
    "0d0m0m2m2m6m6d2d2d0d", // D
    "5m0m0m0d0d5d 0i4i", // E
    "5m0m0m0d 0i4i", // F
    "6k6m0m0d6d6h6h4h", // G
    "0d0m 6d6m 0i6i", // H
    "0d0m", // I
    "4m4g4g4d0d0f", // J
    "0d0m 5m0g 2i5d", // K
    "0m0d0d5d", // L
    "0d0m0m3g3g6m6m6d", // M
    "0d0m0m6d6d6m", // N
    "3m6m6d0d0m3m", // O
    "0d0m0m3m3m6m6h3h3h0h", // P
    "3m6m6d0d0m3m 4f6d", // Q
    "0d0m0m3m3m6m6h3h3h0h 3h6d", // R
    "6k6m0m0i6i6d0d0f", // S
    "0m6m 3m3d", // T
    "0m0g0g0d6d6g6g6m", // U
    "0m3d3d6m", // V
    "0m2d2d4m4m6d6d8m", // W
    "0d6m 0m6d", // X
    "0m3i3i6m 3i3d", // Y
    "0m6m6m0d0d6d", // Z
    "2n0n0n0b0b2b", // [
    "0n4c", // backslash
    "0n2n2n2b2b0b", // ]
    "0j2m2m4j", // ^
    "0c5c", // _
    "0m1k", // `
    "5g5j0j0d5d5g 5j5d", // a
    "0m0d 0g0j5j5d0d0g", // b
    "5h5j0j0d5d5f", // c
    "5g5j0j0d5d5g 5m5d", // d
    "0g5g5g5j0j0d5d5e", // e
    "4m2m2k2k2d 0j4j", // f
    "5g5j0j0d5d5g 5j5c5c5a0a0b", // g
    "0m0d 0g0j5j5g5g5d", // h
    "0j0d 0l0l", // i
    "2j2c2c2a0a 2l2l", // j
    "0m0d 4j0f 1g4d", // k
    "0m0d", // l
    "0j0d 0g0j4j4g4g4d 4g4j8j8g8g8d", // m
    "0j0d 0g0j5j5g5g5d", // n
    "0g0j5j5d0d0g", // o
    "0j0a 0g0j5j5d0d0g", // p
    "5j5a 5g5j0j0d5d5g", // q
    "0j0d 0g0j3j", // r
    "4h4j0j0g4g4d0d0f", // s
    "2l2f2f2d4d 0j4j", // t
    "0j0g0g0d5d5g 5j5d", // u
    "0j2d2d4j", // v
    "0j2d2d4j4j6d6d8j", // w
    "0d4j 0j4d", // x
    "0j2d 4j1a", // y
    "0j4j4j0d0d4d", // z
    "3n1n1h0h 0h1h1b3b", // {
    "0n0b", // |
    "0n2n2h3h 3h2h2b0b", // }
    "0g0i3i3f6f6h", // ~
};

constexpr double kUnit = kTextHeight / ('m' - 'd'); // px
constexpr double kStroke = 1.35; // px
constexpr double kGap = 2.6; // units between glyphs
constexpr double kBlank = 1.0; // units, the width of a space

std::string_view
glyph(char character)
{
  const bool printable = character >= ' ' && character <= '~';
  return kGlyphs[static_cast<std::size_t>((printable ? character : '?') - ' ')];
}

/// In units.
double
advance(char character)
{
  int right = 0;
  for (const char c : glyph(character))
    if (c >= '0' && c <= '9')
      right = std::max(right, c - '0');
  return kGap + (character == ' ' ? kBlank : right);
}

ScreenPoint
middle(const ScreenPoint& a, const ScreenPoint& b)
{
  return {0.5 * (a.x + b.x), 0.5 * (a.y + b.y)};
}

/// A quadratic Bezier curve.
void
drawCurve(Canvas& canvas,
          const ScreenPoint& from,
          const ScreenPoint& control,
          const ScreenPoint& to,
          const Rgb& color)
{
  constexpr int kPieces = 6;
  ScreenPoint last = from;
  for (int i = 1; i <= kPieces; ++i) {
    const double t = static_cast<double>(i) / kPieces, s = 1.0 - t;
    const ScreenPoint next{s * s * from.x + 2.0 * s * t * control.x + t * t * to.x,
                           s * s * from.y + 2.0 * s * t * control.y + t * t * to.y};
    canvas.drawLine(last, next, kStroke, color);
    last = next;
  }
}

/// \param x, y of the left end of the foot.
void
drawStroke(Canvas& canvas,
           double x,
           double y,
           std::string_view stroke,
           const Rgb& color)
{
  std::vector<ScreenPoint> points;
  for (std::size_t i = 0; i + 1 < stroke.size(); i += 2)
    points.push_back(
        {x + kUnit * (stroke[i] - '0'), y - kUnit * (stroke[i + 1] - 'd')});
  if (points.size() == 2)
    canvas.drawLine(points[0], points[1], kStroke, color);
  ScreenPoint from = points.front();
  for (std::size_t i = 1; i + 1 < points.size(); ++i) {
    const ScreenPoint to =
        i + 2 < points.size() ? middle(points[i], points[i + 1]) : points.back();
    drawCurve(canvas, from, points[i], to, color);
    from = to;
  }
}

} // namespace

double
textWidth(const std::string& text)
{
  double units = text.empty() ? 0.0 : -kGap;
  for (const char character : text)
    units += advance(character);
  return kUnit * units;
}

void
drawText(Canvas& canvas,
         double x,
         double y,
         const std::string& text,
         TextAlign align,
         const Rgb& color)
{
  const double width = textWidth(text);
  x -= align == TextAlign::Right  ? width :
       align == TextAlign::Centre ? 0.5 * width :
                                    0.0;
  for (const char character : text) {
    std::string_view strokes = glyph(character);
    while (!strokes.empty()) {
      const std::size_t end = std::min(strokes.find(' '), strokes.size());
      drawStroke(canvas, x, y, strokes.substr(0, end), color);
      strokes.remove_prefix(std::min(end + 1, strokes.size()));
    }
    x += kUnit * advance(character);
  }
}

std::string
shortened(const std::string& text, double width)
{
  if (textWidth(text) <= width)
    return text;
  std::string start = text;
  while (!start.empty() && textWidth(start + "...") > width)
    start.pop_back();
  return start + "...";
}

} // namespace holdfast::app
