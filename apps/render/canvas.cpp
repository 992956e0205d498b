#include "canvas.h"

#include <png.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

namespace holdfast::app {
namespace {

constexpr int kSamples = 3; // along each side of a pixel
constexpr float kNothing = -std::numeric_limits<float>::infinity();
constexpr double kOutside = std::numeric_limits<double>::quiet_NaN();

/// Twice the area of the triangle (a, b, (x, y)), positive when clockwise on screen.
double
side(const ScreenPoint& a, const ScreenPoint& b, double x, double y)
{
  return (b.x - a.x) * (y - a.y) - (b.y - a.y) * (x - a.x);
}

std::uint8_t
mixed(std::uint8_t below, std::uint8_t above, double opacity)
{
  return static_cast<std::uint8_t>(std::lround(below + opacity * (above - below)));
}

/// First and one behind the last sample whose middle lies in [low, high].
std::pair<int, int>
sampleRange(double low, double high, int first_pixel, int end_pixel)
{
  // Clamped as double: what is drawn may lie anywhere.
  const auto clamped = [&](double sample) {
    return static_cast<int>(std::clamp(sample,
                                       double(kSamples * first_pixel),
                                       double(kSamples * end_pixel)));
  };
  return {clamped(std::ceil(kSamples * low - 0.5)),
          clamped(std::floor(kSamples * high - 0.5) + 1.0)};
}

} // namespace

Rgb
scaled(const Rgb& color, double factor)
{
  Rgb result;
  for (std::size_t i = 0; i < result.size(); ++i)
    result[i] = static_cast<std::uint8_t>(
        std::lround(std::min(255.0, factor * static_cast<double>(color[i]))));
  return result;
}

Canvas::Canvas(int width, int height, const Rgb& background)
: width_(width)
, height_(height)
, clip_(frame())
, colors_(static_cast<std::size_t>(kSamples * width) *
              static_cast<std::size_t>(kSamples * height),
          background)
, nearness_(colors_.size(), kNothing)
{}

void
Canvas::clip(const Frame& frame)
{
  clip_ = {std::max(frame.left, 0),
           std::max(frame.top, 0),
           std::min(frame.right, width_),
           std::min(frame.bottom, height_)};
}

/// \param nearnessAt of a sample at (x, y); NaN where the shape does not cover it.
template <typename NearnessAt>
void
Canvas::fill(const Box& box,
             const NearnessAt& nearnessAt,
             const Rgb& color,
             double opacity)
{
  const auto [first_u, end_u] =
      sampleRange(box.left, box.right, clip_.left, clip_.right);
  const auto [first_v, end_v] =
      sampleRange(box.top, box.bottom, clip_.top, clip_.bottom);
  for (int v = first_v; v < end_v; ++v)
    for (int u = first_u; u < end_u; ++u) {
      const double nearness = nearnessAt((u + 0.5) / kSamples, (v + 0.5) / kSamples);
      const std::size_t i = static_cast<std::size_t>(v) * kSamples * width_ + u;
      if (!(nearness >= static_cast<double>(nearness_[i])))
        continue;
      for (std::size_t channel = 0; channel < color.size(); ++channel)
        colors_[i][channel] = mixed(colors_[i][channel], color[channel], opacity);
      if (opacity == 1.0)
        nearness_[i] = static_cast<float>(nearness);
    }
}

void
Canvas::drawDisc(const ScreenPoint& center, double radius, const Rgb& color)
{
  drawLine(center, center, 2.0 * radius, color);
}

void
Canvas::drawLine(const ScreenPoint& from,
                 const ScreenPoint& to,
                 double width,
                 const Rgb& color)
{
  const double dx = to.x - from.x, dy = to.y - from.y;
  const double squared_length = dx * dx + dy * dy;
  const double radius = 0.5 * width;
  const auto nearnessAt = [&](double x, double y) {
    const double along = dx * (x - from.x) + dy * (y - from.y);
    const double t =
        squared_length > 0.0 ? std::clamp(along / squared_length, 0.0, 1.0) : 0.0;
    const double aside_x = x - from.x - t * dx, aside_y = y - from.y - t * dy;
    if (aside_x * aside_x + aside_y * aside_y > radius * radius)
      return kOutside;
    // Both may be infinite.
    return from.nearness == to.nearness ?
               from.nearness :
               from.nearness + t * (to.nearness - from.nearness);
  };
  const auto [left, right] = std::minmax({from.x, to.x});
  const auto [top, bottom] = std::minmax({from.y, to.y});
  fill({left - radius, top - radius, right + radius, bottom + radius},
       nearnessAt,
       color);
}

void
Canvas::drawTriangle(const std::array<ScreenPoint, 3>& corners,
                     const Rgb& color,
                     double opacity)
{
  const auto& [a, b, c] = corners;
  const double area = side(a, b, c.x, c.y);
  if (area == 0.0)
    return;
  const auto nearnessAt = [&, &a = a, &b = b, &c = c](double x, double y) {
    const double to_a = side(b, c, x, y) / area;
    const double to_b = side(c, a, x, y) / area;
    const double to_c = side(a, b, x, y) / area;
    if (to_a < 0.0 || to_b < 0.0 || to_c < 0.0)
      return kOutside;
    return to_a * a.nearness + to_b * b.nearness + to_c * c.nearness;
  };
  const auto [left, right] = std::minmax({a.x, b.x, c.x});
  const auto [top, bottom] = std::minmax({a.y, b.y, c.y});
  fill({left, top, right, bottom}, nearnessAt, color, opacity);
}

void
Canvas::drawRectangle(const Frame& frame, const Rgb& color)
{
  const Box box{static_cast<double>(frame.left),
                static_cast<double>(frame.top),
                static_cast<double>(frame.right),
                static_cast<double>(frame.bottom)};
  fill(
      box,
      [](double, double) { return kInFront; },
      color);
}

/// Calls visit(INDEX) for every sample of a pixel.
template <typename Visit>
void
Canvas::visitSamples(int column, int row, const Visit& visit) const
{
  const auto stride = static_cast<std::size_t>(kSamples * width_);
  for (int v = kSamples * row; v < kSamples * (row + 1); ++v)
    for (int u = kSamples * column; u < kSamples * (column + 1); ++u)
      visit(static_cast<std::size_t>(v) * stride + static_cast<std::size_t>(u));
}

double
Canvas::nearness(int column, int row) const
{
  double sum = 0.0;
  int covered = 0;
  visitSamples(column, row, [&](std::size_t i) {
    if (nearness_[i] == kNothing)
      return;
    sum += static_cast<double>(nearness_[i]);
    ++covered;
  });
  return covered > 0 ? sum / covered : static_cast<double>(kNothing);
}

void
Canvas::finish(int column, int row, double factor, double nearness)
{
  visitSamples(column, row, [&](std::size_t i) {
    if (nearness_[i] == kNothing)
      return;
    colors_[i] = scaled(colors_[i], factor);
    nearness_[i] = static_cast<float>(nearness);
  });
}

void
Canvas::writePng(std::ostream& out) const
{
  std::vector<Rgb> pixels;
  pixels.reserve(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_));
  for (int row = 0; row < height_; ++row)
    for (int column = 0; column < width_; ++column) {
      std::array<int, 3> sum{};
      visitSamples(column, row, [&](std::size_t i) {
        for (std::size_t channel = 0; channel < sum.size(); ++channel)
          sum[channel] += colors_[i][channel];
      });
      Rgb& pixel = pixels.emplace_back();
      for (std::size_t channel = 0; channel < sum.size(); ++channel)
        pixel[channel] =
            static_cast<std::uint8_t>(sum[channel] / (kSamples * kSamples));
    }
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<png_uint_32>(width_);
  image.height = static_cast<png_uint_32>(height_);
  image.format = PNG_FORMAT_RGB;
  png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(image);
  std::string bytes(size, '\0');
  if (png_image_write_to_memory(&image,
                                bytes.data(),
                                &size,
                                0,
                                pixels.data(),
                                0,
                                nullptr) == 0)
    throw std::runtime_error(std::string("PNG: ") + image.message);
  out.write(bytes.data(), static_cast<std::streamsize>(size));
}

} // namespace holdfast::app
