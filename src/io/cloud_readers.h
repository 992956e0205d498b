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

/// A cloud as the file has it, before any judgement.
struct RawCloud {
  pcl::PointCloud<pcl::PointXYZ>::Ptr points{new pcl::PointCloud<pcl::PointXYZ>};
  std::vector<Eigen::Matrix3f> covariances;
  CloudFileInfo info;
};

/// Row-major pixels in units of the depth scale; 0: no measurement.
struct DepthImage {
  int width = 0;
  int height = 0;
  std::vector<std::uint16_t> pixels;
};

RawCloud readPcd(std::string_view bytes);
RawCloud readPly(std::string_view bytes);
DepthImage readPng(std::string_view bytes);
DepthImage readPgm(std::string_view bytes);

/// Takes the next line off `text`, without its line end; nothing at the end.
std::optional<std::string_view> takeLine(std::string_view& text);

/// Takes the next word off `text`; empty at the end.
std::string_view takeWord(std::string_view& text);

std::vector<std::string_view> splitWords(std::string_view line);

/// The whole word as a number ("nan" and "inf" included), or nothing.
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
  double read(const char* bytes, bool swap = false) const;
};

} // namespace holdfast::io
