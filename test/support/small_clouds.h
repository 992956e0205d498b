/// \file Small clouds and the bytes of their files.
#pragma once

#include <holdfast/pcl/range_cloud.h>
#include <holdfast/sensor/camera.h>

#include <Eigen/Geometry>

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <limits>
#include <string>
#include <vector>

namespace holdfast::test {

inline Camera
smallCamera(int width, int height)
{
  Camera camera;
  camera.width = width;
  camera.height = height;
  camera.fx = camera.fy = 60.0;
  camera.cx = 0.5 * (width - 1);
  camera.cy = 0.5 * (height - 1);
  return camera;
}

/// A bowl of curvatures 2 and 4 per metre seen in every pixel from 1 m away, from
/// `pose`; the first pixel is empty.
inline RangeCloud
bowlCloud(int width, int height, const Pose& pose = {}, bool with_covariances = false)
{
  const Camera camera = smallCamera(width, height);
  pcl::PointCloud<pcl::PointXYZ>::Ptr points(
      new pcl::PointCloud<pcl::PointXYZ>(static_cast<std::uint32_t>(width),
                                         static_cast<std::uint32_t>(height)));
  auto covariances = std::make_shared<Covariances>();
  for (int v = 0; v < height; ++v)
    for (int u = 0; u < width; ++u) {
      const double du = (u - camera.cx) / camera.fx;
      const double dv = (v - camera.cy) / camera.fy;
      // z = 1 - 2 x^2 - y^2 on the ray x = du z, y = dv z, and a ripple of 1 mm that
      // stands for noise.
      const double a = 2.0 * du * du + dv * dv;
      const double depth = 2.0 / (1.0 + std::sqrt(1.0 + 4.0 * a)) +
                           1e-3 * std::sin(7.0 * u + 3.0 * v * v);
      const Eigen::Vector3d q = pose.toWorld(camera.backProject(u, v, depth));
      (*points)(u, v).getVector3fMap() = q.cast<float>();
      if (with_covariances) {
        const Eigen::Vector3d sigma(4e-4, 5e-4, 1e-3 + 1e-5 * u);
        const Eigen::Matrix3d R = pose.R;
        covariances->emplace_back(
            (R * sigma.cwiseAbs2().asDiagonal() * R.transpose()).cast<float>());
      }
    }
  const float nan = std::numeric_limits<float>::quiet_NaN();
  (*points)[0] = pcl::PointXYZ(nan, nan, nan);
  points->is_dense = false;
  RangeCloud cloud;
  cloud.points = points;
  cloud.covariances = covariances;
  cloud.sensor_pose = pose;
  return cloud;
}

/// A pose whose camera sees the bowl and that has no zero entries.
inline Pose
tiltedPose()
{
  const Eigen::Quaterniond q(0.8, -0.3, 0.4, 0.2);
  return {q.normalized().toRotationMatrix(), {0.3, -0.2, 1.1}};
}

template <typename T>
std::string
rawBytes(T value, bool big_endian = false)
{
  std::string bytes(sizeof(T), '\0');
  std::memcpy(bytes.data(), &value, sizeof(T));
  return big_endian ? std::string(bytes.rbegin(), bytes.rend()) : bytes;
}

/// A PCD header; the data have to be appended.
inline std::string
pcdHeader(const std::string& fields, int width, int height, const std::string& data)
{
  return "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\n" + fields +
         "WIDTH " + std::to_string(width) + "\nHEIGHT " + std::to_string(height) +
         "\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS " + std::to_string(width * height) +
         "\nDATA " + data + "\n";
}

inline const std::string kXyzFields =
    "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\n";

/// The cloud as a binary_compressed PCD whose LZF stream holds literals only.
inline std::string
compressedPcd(const RangeCloud& cloud)
{
  std::string plain;
  for (int axis = 0; axis < 3; ++axis)
    for (const auto& point : *cloud.points)
      plain += rawBytes(point.data[axis]);
  std::string packed;
  for (std::size_t i = 0; i < plain.size(); i += 32) {
    const std::string run = plain.substr(i, 32);
    packed += static_cast<char>(run.size() - 1) + run;
  }
  return pcdHeader(kXyzFields,
                   static_cast<int>(cloud.points->width),
                   static_cast<int>(cloud.points->height),
                   "binary_compressed") +
         rawBytes(static_cast<std::uint32_t>(packed.size())) +
         rawBytes(static_cast<std::uint32_t>(plain.size())) + packed;
}

/// The cloud's finite points as a PLY with coordinates of type T, an extra property
/// before them and a list of faces behind.
template <typename T>
std::string
plyBytes(const RangeCloud& cloud, const std::string& format)
{
  std::string data;
  int count = 0;
  for (const auto& point : *cloud.points) {
    if (!std::isfinite(point.x))
      continue;
    ++count;
    const bool big = format == "binary_big_endian";
    if (format == "ascii") {
      char line[120];
      std::snprintf(line,
                    sizeof(line),
                    "7 %.9g %.9g %.9g\n",
                    static_cast<double>(point.x),
                    static_cast<double>(point.y),
                    static_cast<double>(point.z));
      data += line;
      continue;
    }
    data += '\7';
    for (int axis = 0; axis < 3; ++axis)
      data += rawBytes(static_cast<T>(point.data[axis]), big);
  }
  const std::string type = sizeof(T) == 4 ? "float" : "double";
  const std::string face = format == "ascii" ? std::string("3 0 1 2\n") :
                                               '\3' + rawBytes(std::int32_t{0}) +
                                                   rawBytes(std::int32_t{1}) +
                                                   rawBytes(std::int32_t{2});
  return "ply\nformat " + format + " 1.0\ncomment a test\nelement vertex " +
         std::to_string(count) + "\nproperty uchar label\nproperty " + type +
         " x\nproperty " + type + " y\nproperty " + type +
         " z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n" +
         data + face;
}

/// Depths in units of 1/depth_scale m as a PGM; 0: nothing.
inline std::string
pgmBytes(const RangeCloud& cloud, double depth_scale)
{
  std::string bytes = "P5\n# a comment\n" + std::to_string(cloud.points->width) + " " +
                      std::to_string(cloud.points->height) + "\n65535\n";
  for (const auto& point : *cloud.points) {
    const double units =
        std::isfinite(point.z) ? std::round(point.z * depth_scale) : 0.0;
    bytes += rawBytes(static_cast<std::uint16_t>(units), true);
  }
  return bytes;
}

/// One chunk of a PNG: length, type, data and their CRC-32.
inline std::string
pngChunk(const std::string& type, const std::string& data)
{
  std::uint32_t crc = 0xffffffffU;
  for (const char c : type + data) {
    crc ^= static_cast<unsigned char>(c);
    for (int bit = 0; bit < 8; ++bit)
      crc = (crc >> 1) ^ ((crc & 1U) != 0 ? 0xedb88320U : 0U);
  }
  return rawBytes(static_cast<std::uint32_t>(data.size()), true) + type + data +
         rawBytes(~crc, true);
}

/// The same as a 16-bit gray PNG, its pixels in one stored (not compressed) block.
inline std::string
pngBytes(const RangeCloud& cloud, double depth_scale)
{
  const std::size_t row_bytes = 2 * cloud.points->width;
  const std::string pgm = pgmBytes(cloud, depth_scale);
  std::string rows;
  for (std::size_t at = pgm.size() - row_bytes * cloud.points->height; at < pgm.size();
       at += row_bytes)
    rows += '\0' + pgm.substr(at, row_bytes); // no filter
  std::uint32_t a = 1; // Adler-32
  std::uint32_t b = 0;
  for (const char c : rows) {
    a = (a + static_cast<unsigned char>(c)) % 65521U;
    b = (b + a) % 65521U;
  }
  const auto size = static_cast<std::uint16_t>(rows.size());
  const std::string zlib = "\x78\x01\x01" + rawBytes(size) +
                           rawBytes(static_cast<std::uint16_t>(~size)) + rows +
                           rawBytes(b << 16 | a, true);
  const std::string header = rawBytes(cloud.points->width, true) +
                             rawBytes(cloud.points->height, true) +
                             std::string("\x10\0\0\0\0", 5); // 16 bits, gray
  return "\x89PNG\r\n\x1a\n" + pngChunk("IHDR", header) + pngChunk("IDAT", zlib) +
         pngChunk("IEND", "");
}

} // namespace holdfast::test
