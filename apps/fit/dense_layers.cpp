#include "dense_layers.h"

#include "console.h"
#include "render/render_colors.h"
#include "render/stroke_font.h"
#include "summary.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>

namespace holdfast::app {
namespace {

constexpr Rgb kNoPatch{64, 64, 64};
constexpr Rgb kPaper{255, 255, 255};
constexpr Rgb kInk{0, 0, 0};

constexpr int kSmallestWidth = 400; // px, room for a scale
constexpr int kLegend = 48; // px

Layer
makeLayer(const char* name, const char* label, Layer::Colors colors, int channels = 1)
{
  Layer layer;
  layer.name = name;
  layer.label = label;
  layer.colors = colors;
  layer.channels = channels;
  return layer;
}

template <typename Value>
void
fillLayer(const DenseExtraction& dense, std::vector<float>& values, const Value& value)
{
  constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
  values.reserve(dense.result.patches.size());
  for (const ExtractedPatch& patch : dense.result.patches)
    values.push_back(isAccepted(patch) ? static_cast<float>(value(patch.fit)) : kNone);
}

void
fillNormals(const DenseExtraction& dense,
            const Eigen::Matrix3d& turn,
            std::vector<float>& values)
{
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  values.reserve(3 * dense.result.patches.size());
  for (const ExtractedPatch& patch : dense.result.patches) {
    const Eigen::Vector3d normal =
        isAccepted(patch) ? Eigen::Vector3d(turn * patch.fit.patch.normal()) :
                            Eigen::Vector3d::Constant(kNone);
    for (int i = 0; i < 3; ++i)
      values.push_back(static_cast<float>(normal[i]));
  }
}

/// 1, 2 or 5 times a power of ten that is not below.
double
roundedUp(double value)
{
  if (!(value > 0.0))
    return 1.0;
  const double decade = std::pow(10.0, std::floor(std::log10(value)));
  for (const double digit : {1.0, 2.0, 5.0})
    if (digit * decade >= value)
      return digit * decade;
  return 10.0 * decade;
}

const std::vector<float>&
shownValues(const Layer& layer)
{
  return layer.shown.empty() ? layer.values : layer.shown;
}

/// How far the scale reaches from its middle or from zero: the outer 5 % of the numbers
/// may be beyond.
double
reachOf(const Layer& layer)
{
  constexpr double kShare = 0.95;
  std::vector<double> distances;
  for (const float value : shownValues(layer))
    if (std::isfinite(value))
      distances.push_back(std::abs(value - layer.middle));
  if (distances.empty())
    return 1.0;
  const auto at =
      distances.begin() +
      static_cast<std::ptrdiff_t>(kShare * static_cast<double>(distances.size() - 1));
  std::nth_element(distances.begin(), at, distances.end());
  return roundedUp(*at);
}

/// Blue at 0 over white to red at 1.
Rgb
balance(double t)
{
  constexpr std::array<double, 3> kLow{33.0, 102.0, 172.0},
      kMiddle{247.0, 247.0, 247.0}, kHigh{178.0, 24.0, 43.0};
  t = std::clamp(t, 0.0, 1.0);
  const double out = std::abs(2.0 * t - 1.0);
  Rgb color;
  for (std::size_t i = 0; i < color.size(); ++i)
    color[i] = static_cast<std::uint8_t>(
        std::lround(kMiddle[i] + out * ((t < 0.5 ? kLow : kHigh)[i] - kMiddle[i])));
  return color;
}

/// \param t place on the scale, 0 to 1
Rgb
colorAt(Layer::Colors colors, double t)
{
  return colors == Layer::Colors::Balance ? balance(t) : viridis(t);
}

/// Towards the right, up, and the camera: red, green, blue.
Rgb
axesColor(const float* normal)
{
  const auto channel = [](float x) {
    return static_cast<std::uint8_t>(
        std::lround(127.5F * (1.0F + std::clamp(x, -1.0F, 1.0F))));
  };
  return {channel(normal[0]), channel(-normal[1]), channel(-normal[2])};
}

/// Ends of the scale.
struct Scale {
  double low = 0.0;
  double high = 1.0;
};

Scale
scaleOf(const Layer& layer)
{
  const double reach = reachOf(layer);
  return layer.colors == Layer::Colors::Balance ?
             Scale{layer.middle - reach, layer.middle + reach} :
             Scale{0.0, reach};
}

Rgb
colorOf(const Layer& layer, const Scale& scale, std::size_t place)
{
  const float* value =
      shownValues(layer).data() + place * static_cast<std::size_t>(layer.channels);
  if (!std::isfinite(*value))
    return kNoPatch;
  if (layer.colors == Layer::Colors::Axes)
    return axesColor(value);
  return colorAt(layer.colors, (*value - scale.low) / (scale.high - scale.low));
}

void
drawScale(Canvas& canvas, const Layer& layer, const Scale& scale, int top)
{
  constexpr int kMargin = 12, kBar = 12; // px
  const int width = canvas.frame().width();
  if (layer.colors == Layer::Colors::Axes) {
    drawText(canvas, kMargin, top + 28, layer.label, TextAlign::Left, kInk);
    return;
  }
  const int left = kMargin + static_cast<int>(textWidth(layer.label)) + 2 * kMargin;
  const int length = std::max(width - left - 2 * kMargin, 1);
  drawText(canvas, kMargin, top + 18, layer.label, TextAlign::Left, kInk);
  for (int i = 0; i < length; ++i)
    canvas.drawRectangle({left + i, top + 8, left + i + 1, top + 8 + kBar},
                         colorAt(layer.colors, (i + 0.5) / length));
  for (const double t : {0.0, 0.5, 1.0})
    drawText(canvas,
             left + t * length,
             top + 40,
             formatNumber("%g", scale.low + t * (scale.high - scale.low)),
             TextAlign::Centre,
             kInk);
}

} // namespace

std::vector<Layer>
layersOf(const DenseExtraction& dense, const Pose& sensor_pose)
{
  using Colors = Layer::Colors;
  std::vector<Layer> layers{
      makeLayer("normal",
                "normal: red right, green up, blue to the camera",
                Colors::Axes,
                3),
      makeLayer("kappa_min", "smaller curvature (1/m)", Colors::Balance),
      makeLayer("kappa_max", "larger curvature (1/m)", Colors::Balance),
      makeLayer("sigma_normal", "sigma of the normal (degrees)", Colors::Sequence),
      makeLayer("chi2_ratio", "chi-square over its mean", Colors::Balance)};
  fillNormals(dense, Eigen::Matrix3d::Identity(), layers[0].values);
  fillNormals(dense, sensor_pose.R.transpose(), layers[0].shown);
  fillLayer(dense, layers[1].values, [](const FitResult& fit) {
    return fit.patch.principalCurvatures().minCoeff();
  });
  fillLayer(dense, layers[2].values, [](const FitResult& fit) {
    return fit.patch.principalCurvatures().maxCoeff();
  });
  fillLayer(dense, layers[3].values, normalSigma);
  fillLayer(dense, layers[3].shown, normalSigmaDegrees);
  fillLayer(dense, layers[4].values, chi2PerDof);
  layers[4].middle = 1.0;
  return layers;
}

void
writePfm(std::ostream& out, const Layer& layer, int width, int height)
{
  const std::uint16_t one = 1;
  std::uint8_t first_byte = 0;
  std::memcpy(&first_byte, &one, 1);
  const char* const order = first_byte == 1 ? "-1.0" : "1.0"; // little, big
  out << (layer.channels == 3 ? "PF\n" : "Pf\n") << width << ' ' << height << '\n'
      << order << '\n';
  const auto row = static_cast<std::size_t>(width * layer.channels);
  for (int v = height - 1; v >= 0; --v)
    out.write(reinterpret_cast<const char*>(layer.values.data() +
                                            static_cast<std::size_t>(v) * row),
              static_cast<std::streamsize>(row * sizeof(float)));
}

Canvas
pictureOf(const Layer& layer, int width, int height)
{
  const int factor = std::max(1, (kSmallestWidth + width - 1) / width);
  const int bottom = factor * height;
  Canvas canvas(std::max(factor * width, kSmallestWidth), bottom + kLegend, kPaper);
  const Scale scale = scaleOf(layer);
  for (int v = 0; v < height; ++v)
    for (int u = 0; u < width; ++u)
      canvas.drawRectangle(
          {factor * u, factor * v, factor * (u + 1), factor * (v + 1)},
          colorOf(layer, scale, static_cast<std::size_t>(v * width + u)));
  drawScale(canvas, layer, scale, bottom);
  return canvas;
}

} // namespace holdfast::app
