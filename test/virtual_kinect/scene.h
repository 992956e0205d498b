/// \file What the virtual Kinect sees: a closed form of frame number and pixel, so that
/// a test knows every value of every frame.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

namespace virtual_kinect {

/// Fields of view of a Kinect or Xtion, rad: the depth camera's focal length is 575.8
/// px at VGA, the colour camera's 531.1 px.
constexpr float kDepthHorizontalFov = 1.0144687F;
constexpr float kDepthVerticalFov = 0.7898090F;
constexpr float kColorHorizontalFov = 1.0821042F;
constexpr float kColorVerticalFov = 0.8480621F;

constexpr int kFramesPerSecond = 30;
constexpr int kMaxDepthMm = 10000;

/// Depth images repeat after this many frames, with their noise.
constexpr int kPeriod = 60;

/// Device clock, microseconds, when frame 1, 2, ... was taken.
inline std::uint64_t
timestampUs(int frame)
{
  return static_cast<std::uint64_t>(frame) * 1000000U / kFramesPerSecond;
}

/// Smaller root of a t^2 - 2 b t + c, infinite when there is none.
inline double
firstRoot(double a, double b, double c)
{
  const double discriminant = b * b - a * c;
  return discriminant > 0.0 ? (b - std::sqrt(discriminant)) / a :
                              std::numeric_limits<double>::infinity();
}

/// Depth z, m, of the ray (x, y, 1) from a camera 0.7 m above a table, which looks down
/// on it by 35 degrees. On the table: a log across the view, a ball that rests, one
/// that rolls to and fro, and a slope that rises to the right.
inline double
sceneDepth(int frame, double x, double y)
{
  constexpr double kHeight = 0.7, kSin = 0.573576436351046, kCos = 0.819152044288992;
  const double up = -kCos * y - kSin;
  const double ahead = kCos - kSin * y;
  const auto ball = [&](double right, double distance, double radius) {
    const double above = radius - kHeight; // of the camera
    return firstRoot(x * x + up * up + ahead * ahead,
                     x * right + up * above + ahead * distance,
                     right * right + above * above + distance * distance -
                         radius * radius);
  };
  const auto log = [&](double distance, double radius) {
    const double above = radius - kHeight;
    return firstRoot(up * up + ahead * ahead,
                     up * above + ahead * distance,
                     above * above + distance * distance - radius * radius);
  };
  constexpr double kPi = 3.14159265358979323846;
  const double table = -kHeight / up;
  const double slope = (kHeight + 0.3 * 0.25) / (0.3 * x - up);
  const double rolling = 0.3 * std::sin(2.0 * kPi * frame / kPeriod);
  return std::min(
      {table, slope, log(1.5, 0.1), ball(-0.25, 1.05, 0.1), ball(rolling, 0.75, 0.06)});
}

/// Noise of a pixel, standard deviation 1: the sum of four uniform numbers, which is
/// near enough to a Gaussian. They are the quarters of a hash (splitmix64).
inline double
noise(int frame, int u, int v)
{
  std::uint64_t hash =
      (static_cast<std::uint64_t>(frame) << 40U | static_cast<std::uint64_t>(v) << 20U |
       static_cast<std::uint64_t>(u)) *
          0x9E3779B97F4A7C15U +
      0x9E3779B97F4A7C15U;
  hash = (hash ^ hash >> 30U) * 0xBF58476D1CE4E5B9U;
  hash = (hash ^ hash >> 27U) * 0x94D049BB133111EBU;
  hash ^= hash >> 31U;
  const std::uint64_t sum = (hash & 0xFFFFU) + (hash >> 16U & 0xFFFFU) +
                            (hash >> 32U & 0xFFFFU) + (hash >> 48U);
  return (static_cast<double>(sum) / 65536.0 - 2.0) * std::sqrt(3.0);
}

/// Depth of a pixel, mm; 0: no measurement. Not mirrored. It is what a Kinect reports:
/// a disparity in steps of 1/8 px, with a standard deviation of 0.17 px.
inline std::uint16_t
depthMm(int frame, int u, int v, int width, int height)
{
  frame %= kPeriod;
  if (u < width / 80)
    return 0; // the pattern's projector does not see the edge
  const double f = width / 2.0 / std::tan(kDepthHorizontalFov / 2.0);
  const double z =
      sceneDepth(frame, (u - (width - 1) / 2.0) / f, (v - (height - 1) / 2.0) / f);
  constexpr double kFocalTimesBaseline = 580.0 * 0.075; // px m
  // The steps add 0.036 px.
  constexpr double kSigmaPx = 0.166;
  const double disparity = kFocalTimesBaseline / z + kSigmaPx * noise(frame, u, v);
  return static_cast<std::uint16_t>(
      std::lround(8000.0 * kFocalTimesBaseline / std::round(8.0 * disparity)));
}

/// Red, green, blue of a pixel. Not mirrored.
inline std::array<std::uint8_t, 3>
color(int frame, int u, int v)
{
  return {static_cast<std::uint8_t>(u),
          static_cast<std::uint8_t>(v),
          static_cast<std::uint8_t>(frame)};
}

} // namespace virtual_kinect
