#include "render_colors.h"

#include "console.h"
#include "stroke_font.h"
#include "summary.h"

#include <holdfast/io/patch_io.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace holdfast::app {
namespace {

constexpr Rgb kNoNumber{150, 150, 150};
constexpr int kLine = 22; // px, of a row of the legend
constexpr int kSwatch = 14; // px, of a type's colour

bool
isShown(double value)
{
  return std::isfinite(value) && value > 0.0;
}

/// The positive numbers of the patches, sorted.
std::vector<double>
numbersOf(const Measure& measure, const std::vector<ExtractedPatch>& patches)
{
  std::vector<double> numbers;
  for (const ExtractedPatch& patch : patches)
    if (const double value = measure.value(patch.fit); isShown(value))
      numbers.push_back(value);
  std::sort(numbers.begin(), numbers.end());
  return numbers;
}

/// 1, 2 and 5 times powers of ten, from the last that is not above `low` to the first
/// that is not below `high`; two at least.
std::vector<double>
roundNumbers(double low, double high)
{
  std::vector<double> numbers;
  for (int exponent = static_cast<int>(std::floor(std::log10(low)));; ++exponent)
    for (const int digit : {1, 2, 5}) {
      const double number = digit * std::pow(10.0, exponent);
      if (number <= low)
        numbers.clear();
      numbers.push_back(number);
      if (number >= high && number > low)
        return numbers;
    }
}

/// Place of a value on a logarithmic scale: 0 at the first tick, 1 at the last.
double
fraction(const std::vector<double>& ticks, double value)
{
  return std::log(value / ticks.front()) / std::log(ticks.back() / ticks.front());
}

/// px, of a type's colour and name and the gap to the next.
double
entryWidth(SurfaceType type)
{
  return kSwatch + 8 + textWidth(spacedName(type)) + 24;
}

/// The entries of the legend, as many in a row as there is room for.
std::vector<std::vector<SurfaceType>>
entryRows(const std::set<SurfaceType>& types, double width)
{
  std::vector<std::vector<SurfaceType>> rows;
  double used = 0.0;
  for (const SurfaceType type : types) {
    if (rows.empty() || used + entryWidth(type) > width) {
      rows.emplace_back();
      used = 0.0;
    }
    rows.back().push_back(type);
    used += entryWidth(type);
  }
  return rows;
}

} // namespace

const std::vector<Measure>&
measures()
{
  static const std::vector<Measure> kMeasures{
      {"sigma-normal", "sigma of the normal (degrees)", normalSigmaDegrees},
      {"sigma-centre", "sigma of the centre (mm)", centreSigmaMillimetres},
      {"chi2", "chi-square per degree of freedom", chi2PerDof}};
  return kMeasures;
}

std::string
spacedName(SurfaceType surface)
{
  std::string name(surfaceName(surface));
  std::replace(name.begin(), name.end(), '_', ' ');
  return name;
}

Rgb
viridis(double t)
{
  // The polynomials of degree six that M. Zucker fitted to the map of S. van der Walt
  // and N. Smith; lowest order first.
  constexpr std::array<std::array<double, 7>, 3> kCoefficients{
      {{0.277727, 0.105093, -0.330862, -4.634230, 6.228270, 4.776385, -5.435456},
       {0.005407, 1.404614, 0.214848, -5.799101, 14.179933, -13.745145, 4.645853},
       {0.334100, 1.384590, 0.095095, -19.332441, 56.690553, -65.353033, 26.312435}}};
  t = std::clamp(t, 0.0, 1.0);
  Rgb color;
  for (std::size_t channel = 0; channel < color.size(); ++channel) {
    double value = 0.0;
    for (auto c = kCoefficients[channel].rbegin(); c != kCoefficients[channel].rend();
         ++c)
      value = value * t + *c;
    color[channel] =
        static_cast<std::uint8_t>(std::lround(255.0 * std::clamp(value, 0.0, 1.0)));
  }
  return color;
}

PatchColors::PatchColors(const Measure* measure,
                         const std::vector<ExtractedPatch>& patches)
: measure_(measure)
{
  for (const ExtractedPatch& patch : patches)
    types_.insert(patch.fit.patch.type.surface);
  if (measure == nullptr)
    return;
  const std::vector<double> numbers = numbersOf(*measure, patches);
  if (numbers.empty())
    throw std::runtime_error("no patch has a " + measure->label);
  const auto last = static_cast<double>(numbers.size() - 1);
  ticks_ = roundNumbers(numbers[static_cast<std::size_t>(std::lround(0.05 * last))],
                        numbers[static_cast<std::size_t>(std::lround(0.95 * last))]);
}

Rgb
PatchColors::operator()(const FitResult& fit) const
{
  if (measure_ == nullptr)
    return surfaceColor(fit.patch.type.surface);
  const double value = measure_->value(fit);
  return isShown(value) ? viridis(fraction(ticks_, value)) : kNoNumber;
}

int
PatchColors::legendHeight(int width) const
{
  return kLine *
         (measure_ != nullptr ? 2 : static_cast<int>(entryRows(types_, width).size()));
}

void
PatchColors::drawLegend(Canvas& canvas, const Frame& frame, const Rgb& text) const
{
  canvas.clip(frame);
  if (measure_ != nullptr)
    drawBar(canvas, frame, text);
  else
    drawTypes(canvas, frame, text);
}

void
PatchColors::drawTypes(Canvas& canvas, const Frame& frame, const Rgb& text) const
{
  int top = frame.top + 2;
  for (const std::vector<SurfaceType>& row : entryRows(types_, frame.width())) {
    double width = 0.0;
    for (const SurfaceType type : row)
      width += entryWidth(type);
    double x = 0.5 * (frame.left + frame.right - width);
    for (const SurfaceType type : row) {
      const int left = static_cast<int>(x);
      canvas.drawRectangle({left, top, left + kSwatch, top + kSwatch},
                           surfaceColor(type));
      drawText(canvas,
               left + kSwatch + 8,
               top + 12,
               spacedName(type),
               TextAlign::Left,
               text);
      x += entryWidth(type);
    }
    top += kLine;
  }
}

void
PatchColors::drawBar(Canvas& canvas, const Frame& frame, const Rgb& text) const
{
  std::vector<ScaleTick> ticks;
  for (const double tick : ticks_)
    ticks.push_back({fraction(ticks_, tick), formatNumber("%g", tick)});
  drawScale(canvas, frame, measure_->label, ticks, viridis, text);
}

void
drawScale(Canvas& canvas,
          const Frame& frame,
          const std::string& title,
          const std::vector<ScaleTick>& ticks,
          Rgb (*color)(double),
          const Rgb& text)
{
  constexpr int kGap = 14, kBarHeight = 14, kTickRoom = 40; // px
  const int label = static_cast<int>(std::ceil(textWidth(title)));
  const int length = std::clamp(frame.width() - label - 5 * kGap, 80, 420);
  const int left = (frame.left + frame.right - label - kGap - length) / 2;
  const int start = left + label + kGap;
  drawText(canvas, left, frame.top + 14, title, TextAlign::Left, text);
  for (int i = 0; i < length; ++i)
    canvas.drawRectangle(
        {start + i, frame.top + 2, start + i + 1, frame.top + 2 + kBarHeight},
        color((i + 0.5) / length));
  double last = -kTickRoom;
  for (const ScaleTick& tick : ticks) {
    const double at = length * tick.place;
    if (at - last < kTickRoom)
      continue;
    last = at;
    drawText(canvas,
             start + at,
             frame.top + kLine + 10,
             tick.text,
             TextAlign::Centre,
             text);
  }
}

} // namespace holdfast::app
