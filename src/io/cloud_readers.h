/// \file The readers behind loadCloud(), one per format: bytes in, raw cloud out.
///
/// They trust nothing: every size a header announces is compared with the bytes that
/// are there before anything is allocated. They throw std::runtime_error with the cause
/// alone; loadCloud() puts the name of the file in front.
#pragma once

#include <holdfast/io/cloud_io.h>

#include <cstdint>
#include <cstring>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace holdfast::io {

/// A cloud as the file has it, before any judgement; points and covariances in m.
struct RawCloud {
  pcl::PointCloud<pcl::PointXYZ>::Ptr points{new pcl::PointCloud<pcl::PointXYZ>};
  std::vector<Eigen::Matrix3f> covariances;
  Eigen::Vector3d offset = Eigen::Vector3d::Zero(); ///< of RangeCloud
  CloudFileInfo info;
};

/// Row-major pixels in units of the depth scale; 0: no measurement.
struct DepthImage {
  int width = 0;
  int height = 0;
  std::vector<std::uint16_t> pixels;
  std::vector<std::string> notices;
};

RawCloud readPcd(std::string_view bytes, const LoadOptions& options);
RawCloud readPly(std::string_view bytes, const LoadOptions& options);
DepthImage readPng(std::string_view bytes, std::uint64_t max_points);
DepthImage readPgm(std::string_view bytes, std::uint64_t max_points);

/// Back-projects the pixels; the cloud is in the camera frame.
/// \throw std::runtime_error when the pixels cannot be depths.
RawCloud backProject(DepthImage& image, const LoadOptions& options);

/// \throw std::runtime_error when there are more points than allowed.
void checkPointCount(std::uint64_t points, std::uint64_t max_points);

/// Where coordinates that float would round by more than 10 um come from, in whole
/// metres near their middle; zero when float is good enough. `xyz`: three per point, m.
Eigen::Vector3d offsetOf(const std::vector<double>& xyz);

/// Makes the points of the cloud from coordinates in m, shifted when they are too large
/// for float.
void placePoints(const std::vector<double>& xyz, RawCloud& cloud);

/// Text of a file as it may be shown: one line of printable characters.
std::string printable(std::string_view text);

/// Without a byte order mark and the blank lines before the first word.
std::string_view skipToText(std::string_view bytes);

/// The character that ends the lines of a text: '\r' when its first line ends with that
/// alone, else '\n', with or without a '\r' before it.
char lineEnd(std::string_view text);

/// Takes the next line off `text`, without its line end; nothing at the end.
std::optional<std::string_view> takeLine(std::string_view& text, char line_end = '\n');

/// Takes the next word off `text`; empty at the end.
std::string_view takeWord(std::string_view& text);

std::vector<std::string_view> splitWords(std::string_view line);

/// The whole word as a number, or nothing. What is too small for double is 0, what is
/// too large infinite; "nan" and "inf" are numbers however they are spelled
/// ("1.#QNAN").
std::optional<double> parseNumber(std::string_view word);

/// The whole word as a non-negative integer, or nothing.
std::optional<std::uint64_t> parseCount(std::string_view word);

/// a * b * c, or nothing where it overflows.
std::optional<std::uint64_t> product(std::uint64_t a,
                                     std::uint64_t b,
                                     std::uint64_t c = 1);

/// A number in binary data. Kind: 'F' floating, 'I' signed, 'U' unsigned.
struct ScalarType {
  char kind = 'F';
  int size = 4; ///< bytes

  /// F 4 8, I and U 1 2 4 8.
  bool isValid() const;

  /// Value at `bytes`, unaligned; `swap` reverses the byte order first.
  double read(const char* bytes, bool swap = false) const
  {
    if (kind != 'F' || size != 4 || swap)
      return readOther(bytes, swap);
    float value; // nearly every value of a cloud
    std::memcpy(&value, bytes, sizeof(value));
    return static_cast<double>(value);
  }

  double readOther(const char* bytes, bool swap) const;
};

} // namespace holdfast::io
