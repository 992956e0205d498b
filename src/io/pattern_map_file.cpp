#include "cloud_readers.h"

#include <holdfast/io/atomic_file.h>
#include <holdfast/io/pattern_map_file.h>

#include <png.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <stdexcept>
#include <vector>

namespace holdfast {
namespace {

constexpr double kZero = 32768.0; // value of no error
constexpr double kStepsPerPx = 1024.0;
constexpr std::uint16_t kUnknown = 0;
constexpr std::uint64_t kMostPixels = 50000000;

std::string
readBytes(const std::string& path)
{
  std::error_code ignored;
  if (!std::filesystem::exists(path, ignored))
    throw std::runtime_error("no such file");
  if (!std::filesystem::is_regular_file(path, ignored))
    throw std::runtime_error("is not a regular file");
  std::ifstream file(path, std::ios::binary);
  if (!file)
    throw std::runtime_error("cannot be opened");
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

std::uint16_t
valueOf(float error_px)
{
  if (std::isnan(error_px))
    return kUnknown;
  constexpr double kMost = std::numeric_limits<std::uint16_t>::max();
  return static_cast<std::uint16_t>(
      std::clamp(std::round(kZero + kStepsPerPx * static_cast<double>(error_px)),
                 1.0,
                 kMost));
}

} // namespace

PatternMap
loadPatternMap(const std::string& path)
{
  try {
    const std::string bytes = readBytes(path);
    constexpr std::string_view kSignature("\x89PNG\r\n\x1a\n", 8);
    if (bytes.compare(0, kSignature.size(), kSignature) != 0)
      throw std::runtime_error("is no PNG, as a pattern map is");
    const io::DepthImage image = io::readPng(bytes, kMostPixels);
    if (!image.notices.empty()) // other bytes behind it: nobody wrote that so
      throw std::runtime_error(image.notices.front());
    std::vector<float> errors;
    for (const std::uint16_t value : image.pixels)
      errors.push_back(value == kUnknown ?
                           std::numeric_limits<float>::quiet_NaN() :
                           static_cast<float>((value - kZero) / kStepsPerPx));
    return {image.width, image.height, std::move(errors)};
  }
  catch (const std::runtime_error& error) {
    throw std::runtime_error(path + ": " + error.what());
  }
}

void
savePatternMap(const std::string& path, const PatternMap& map)
{
  std::vector<std::uint16_t> values;
  for (const float error : map.errors())
    values.push_back(valueOf(error));
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<png_uint_32>(map.width());
  image.height = static_cast<png_uint_32>(map.height());
  image.format = PNG_FORMAT_LINEAR_Y; // 16 bits, as they are
  png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(image);
  std::string bytes(size, '\0');
  if (png_image_write_to_memory(&image,
                                bytes.data(),
                                &size,
                                0,
                                values.data(),
                                0,
                                nullptr) == 0)
    throw std::runtime_error(path + ": PNG: " + image.message);
  AtomicFile file(path);
  file.stream().write(bytes.data(), static_cast<std::streamsize>(size));
  file.commit();
}

} // namespace holdfast
