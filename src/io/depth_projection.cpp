/// From the pixels of a depth image to points, after a look at whether they can be
/// depths.
#include "cloud_readers.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>

#include <fmt/format.h>

namespace holdfast::io {
namespace {

/// What cameras write where they saw nothing: 0, or the largest number.
constexpr std::uint16_t kSaturated = 65535;

bool
isMeasured(std::uint16_t units)
{
  return units != 0 && units != kSaturated;
}

std::uint16_t
rotateLeft(std::uint16_t units, int bits)
{
  return static_cast<std::uint16_t>(bits == 0 ? units :
                                                units << bits | units >> (16 - bits));
}

/// What is looked at to judge an image: pairs of neighbours in a row, both measured.
using Pairs = std::vector<std::array<std::uint16_t, 2>>;

Pairs
neighbours(const DepthImage& image)
{
  constexpr std::size_t kEnough = 50000;
  const std::size_t step = image.pixels.size() / kEnough + 1;
  const auto width = static_cast<std::size_t>(image.width);
  Pairs pairs;
  for (std::size_t i = 0; i + 1 < image.pixels.size(); i += step)
    if ((i + 1) % width != 0 && isMeasured(image.pixels[i]) &&
        isMeasured(image.pixels[i + 1]))
      pairs.push_back({image.pixels[i], image.pixels[i + 1]});
  return pairs;
}

/// Mean relative step between neighbours after a rotation of all bits: some 0.003 where
/// there are surfaces, above 0.1 where there is noise.
double
roughness(const Pairs& pairs, int bits)
{
  double sum = 0.0;
  for (const auto& pair : pairs) {
    const int a = rotateLeft(pair[0], bits);
    const int b = rotateLeft(pair[1], bits);
    sum += 2.0 * std::abs(a - b) / (a + b);
  }
  return sum / static_cast<double>(pairs.size());
}

/// What speaks against the bits of the pixels, or nothing: in another order they would
/// show surfaces where there is noise now.
std::string
doubtAboutBits(const DepthImage& image)
{
  constexpr std::size_t kFewestPairs = 30;
  constexpr double kNoise = 0.01;
  constexpr double kMuchSmoother = 0.25;
  const Pairs pairs = neighbours(image);
  if (pairs.size() < kFewestPairs)
    return {};
  const double as_it_is = roughness(pairs, 0);
  int best = 0;
  double smoothest = as_it_is;
  for (int bits = 1; bits < 16; ++bits)
    if (const double r = roughness(pairs, bits); r < smoothest) {
      smoothest = r;
      best = bits;
    }
  if (as_it_is < kNoise || smoothest > kMuchSmoother * as_it_is)
    return {};
  const std::string order =
      best == 8 ? "byte-swapped (low byte first)" :
                  fmt::format("rotated by {} bits to the left", 16 - best);
  return fmt::format("the pixels look {}: neighbours differ by {:.0f} %, in the right "
                     "order by {:.1f} %",
                     order,
                     100.0 * as_it_is,
                     100.0 * smoothest);
}

double
shareInRange(const DepthImage& image, double scale, const LoadOptions& options)
{
  std::size_t measured = 0;
  std::size_t in_range = 0;
  for (const std::uint16_t units : image.pixels) {
    if (!isMeasured(units))
      continue;
    ++measured;
    const double depth = units / scale;
    in_range += depth >= options.min_range_m && depth <= options.max_range_m;
  }
  return measured == 0 ? 0.0 :
                         static_cast<double>(in_range) / static_cast<double>(measured);
}

bool
areMultiples(const DepthImage& image, int divisor)
{
  return std::all_of(
      image.pixels.begin(),
      image.pixels.end(),
      [&](std::uint16_t units) { return units == kSaturated || units % divisor == 0; });
}

/// The scale at which the sensor could have taken nearly all pixels, if there is one.
std::optional<double>
likelyScale(const DepthImage& image, const LoadOptions& options)
{
  constexpr double kNearlyAll = 0.98;
  // mm rotated by three bits to the left are 8000 per metre, as long as they fit.
  std::vector<double> scales{1000.0, 5000.0, 10000.0, 8000.0, 100.0};
  if (areMultiples(image, 8))
    scales.insert(scales.begin(), 8000.0);
  for (const double scale : scales)
    if (scale != options.depth_scale &&
        shareInRange(image, scale, options) >= kNearlyAll)
      return scale;
  return std::nullopt;
}

/// What speaks against the depth scale, or nothing.
std::string
doubtAboutScale(const DepthImage& image, const LoadOptions& options, double share)
{
  std::string text = fmt::format(
      "only {:.0f} % of the depths are within the range of the sensor ({} to "
      "{} m) at {} units per metre",
      100.0 * share,
      options.min_range_m,
      options.max_range_m,
      options.depth_scale);
  if (const auto scale = likelyScale(image, options))
    text += fmt::format(
        ", {:.0f} % would be at {}{}",
        100.0 * shareInRange(image, *scale, options),
        *scale,
        *scale == 8000.0 ? " (mm whose bits are rotated by three to the left)" : "");
  return text;
}

/// True when more than a few depths are far outside the range and another scale puts
/// nearly all inside.
bool
isScaleSurelyWrong(const DepthImage& image, const LoadOptions& options, double share)
{
  constexpr double kFewInRange = 0.75;
  constexpr double kNotAFew = 0.03;
  LoadOptions wide = options;
  wide.min_range_m = 0.5 * options.min_range_m;
  wide.max_range_m = 2.0 * options.max_range_m;
  return share < kFewInRange &&
         shareInRange(image, options.depth_scale, wide) < 1.0 - kNotAFew &&
         likelyScale(image, options).has_value();
}

/// \throw std::runtime_error when the pixels cannot be depths of this sensor. A caller
/// who knows the scale gets a notice instead.
void
judge(DepthImage& image, const LoadOptions& options)
{
  if (std::none_of(image.pixels.begin(), image.pixels.end(), isMeasured))
    throw std::runtime_error("has no valid point");
  constexpr double kDoubtful = 0.9;
  const double share = shareInRange(image, options.depth_scale, options);
  std::string doubt = doubtAboutBits(image);
  bool is_sure = !doubt.empty();
  if (doubt.empty() && share < kDoubtful) {
    doubt = doubtAboutScale(image, options, share);
    is_sure = isScaleSurelyWrong(image, options, share);
  }
  if (share == 0.0)
    throw std::runtime_error(
        "no depth is within the range of the sensor: is the depth scale right? " +
        doubt);
  if (doubt.empty())
    return;
  if (is_sure && !options.depth_scale_given)
    throw std::runtime_error(doubt + "; --depth-scale says otherwise");
  image.notices.push_back(doubt);
}

std::string
intrinsicsText(const Camera& camera)
{
  return fmt::format("fx {:.1f} fy {:.1f} cx {:.1f} cy {:.1f}",
                     camera.fx,
                     camera.fy,
                     camera.cx,
                     camera.cy);
}

/// The camera for an image of another size but the same aspect ratio.
Camera
scaledCamera(const Camera& camera, int width, int height)
{
  if (static_cast<std::int64_t>(width) * camera.height !=
      static_cast<std::int64_t>(height) * camera.width)
    throw std::runtime_error(
        fmt::format("an image of {} x {} pixels is not from a camera of {} x {}: "
                    "--intrinsics FX,FY,CX,CY says what it is from",
                    width,
                    height,
                    camera.width,
                    camera.height));
  const double scale = static_cast<double>(width) / camera.width;
  Camera scaled;
  scaled.width = width;
  scaled.height = height;
  scaled.fx = scale * camera.fx;
  scaled.fy = scale * camera.fy;
  // Pixel coordinates are 0 at the centre of the first pixel, -0.5 at its edge.
  scaled.cx = scale * (camera.cx + 0.5) - 0.5;
  scaled.cy = scale * (camera.cy + 0.5) - 0.5;
  return scaled;
}

/// The camera of this image, and a word about what was assumed.
Camera
cameraOf(const DepthImage& image, const LoadOptions& options, CloudFileInfo& info)
{
  Camera camera = options.camera;
  if (options.camera_given) {
    camera.width = image.width;
    camera.height = image.height;
    return camera;
  }
  camera = scaledCamera(camera, image.width, image.height);
  std::string text = fmt::format("camera assumed: {} from {}",
                                 intrinsicsText(camera),
                                 options.camera_name);
  if (camera.width != options.camera.width)
    text += fmt::format(
        "; intrinsics scaled from {} to {} pixels of width: a {} image of the same "
        "view was "
        "assumed; "
        "if it was cut out instead, --intrinsics FX,FY,CX,CY says what it is from",
        options.camera.width,
        camera.width,
        camera.width < options.camera.width ? "smaller" : "larger");
  info.notices.push_back(text);
  return camera;
}

void
noteOutOfRange(const LoadOptions& options, CloudFileInfo& info)
{
  if (info.out_of_range_pixels == 0)
    return;
  const std::string range =
      std::isfinite(options.max_range_m) ?
          fmt::format(" ({} to {} m)", options.min_range_m, options.max_range_m) :
          std::string();
  info.notices.push_back(
      fmt::format("{} pixels beyond the range of the sensor{} are taken as invalid",
                  info.out_of_range_pixels,
                  range));
}

} // namespace

RawCloud
backProject(DepthImage& image, const LoadOptions& options)
{
  if (image.pixels.empty())
    throw std::runtime_error("has no pixels");
  judge(image, options);
  RawCloud cloud;
  CloudFileInfo& info = cloud.info;
  info.is_depth_image = true;
  info.depth_scale = options.depth_scale;
  info.fields = {"depth"};
  info.notices = std::move(image.notices);
  const Camera camera = cameraOf(image, options, info);
  info.camera = camera;
  const float nan = std::numeric_limits<float>::quiet_NaN();
  cloud.points->assign(image.pixels.size(), pcl::PointXYZ(nan, nan, nan));
  for (std::size_t i = 0; i < image.pixels.size(); ++i) {
    const std::uint16_t units = image.pixels[i];
    const double depth = units / options.depth_scale;
    if (units == 0)
      continue;
    if (units == kSaturated || depth < options.min_range_m ||
        depth > options.max_range_m) {
      ++info.out_of_range_pixels;
      continue;
    }
    const auto u = static_cast<int>(i) % image.width;
    const auto v = static_cast<int>(i) / image.width;
    (*cloud.points)[i].getVector3fMap() = camera.backProject(u, v, depth).cast<float>();
  }
  cloud.points->width = static_cast<std::uint32_t>(image.width);
  cloud.points->height = static_cast<std::uint32_t>(image.height);
  noteOutOfRange(options, info);
  return cloud;
}

} // namespace holdfast::io
