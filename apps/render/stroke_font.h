/// \file Text for pictures: a sans-serif font of our own, made of strokes.
#pragma once

#include "canvas.h"

#include <string>

namespace holdfast::app {

enum class TextAlign : std::uint8_t { Left, Centre, Right };

/// Of capitals and digits, px.
inline constexpr double kTextHeight = 10.0;

/// px.
double textWidth(const std::string& text);

/// One line over everything else, its foot (below which g and p reach) at `y`. What is
/// not printable ASCII is shown as '?'.
void drawText(Canvas& canvas,
              double x,
              double y,
              const std::string& text,
              TextAlign align,
              const Rgb& color);

/// The same with dots for the end of what is longer than `width`.
std::string shortened(const std::string& text, double width);

} // namespace holdfast::app
