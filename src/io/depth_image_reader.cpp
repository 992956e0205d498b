/// The pixels of depth images: 16-bit gray PNG, and PGM in both of its forms.
#include "cloud_readers.h"

#include <png.h>

#include <algorithm>
#include <csetjmp>

#include <fmt/format.h>

namespace holdfast::io {
namespace {

/// Where libpng reads from, and what it had to say.
struct PngInput {
  std::string_view bytes;
  std::uint64_t max_points = 0;
  std::string error;
};

void
readBytes(png_structp png, png_bytep out, png_size_t n)
{
  auto& input = *static_cast<PngInput*>(png_get_io_ptr(png));
  if (input.bytes.size() < n)
    png_error(png, "truncated");
  std::memcpy(out, input.bytes.data(), n);
  input.bytes.remove_prefix(n);
}

[[noreturn]] void
keepError(png_structp png, png_const_charp message)
{
  static_cast<PngInput*>(png_get_error_ptr(png))->error = message;
  png_longjmp(png, 1);
}

void
ignoreWarning(png_structp, png_const_charp)
{}

/// Fills the image, or says in input.error why not. libpng reports errors by longjmp:
/// everything with a destructor belongs to the caller.
void
decode(png_structp png, png_infop info, PngInput& input, DepthImage& image)
{
  if (setjmp(png_jmpbuf(png)) != 0)
    return;
  const std::size_t file_bytes = input.bytes.size();
  png_set_read_fn(png, &input, readBytes);
  png_read_info(png, info);
  if (png_get_color_type(png, info) != PNG_COLOR_TYPE_GRAY ||
      png_get_bit_depth(png, info) != 16)
    png_error(png, "not 16-bit gray, so no depth image");
  const std::size_t width = png_get_image_width(png, info);
  const std::size_t height = png_get_image_height(png, info);
  // Deflate packs 1032 bytes into one at best.
  if (2 * width * height / 1032 > file_bytes)
    png_error(png, "truncated or corrupt: too short for its size");
  image.width = static_cast<int>(width);
  image.height = static_cast<int>(height);
  if (width * height > input.max_points)
    return; // the caller has the words for it
  image.pixels.resize(width * height);
  png_set_swap(png);
  const int passes = png_set_interlace_handling(png);
  png_read_update_info(png, info);
  for (int pass = 0; pass < passes; ++pass)
    for (std::size_t row = 0; row < height; ++row)
      png_read_row(png,
                   reinterpret_cast<png_bytep>(image.pixels.data() + row * width),
                   nullptr);
  png_read_end(png, nullptr);
}

/// Takes blanks and comments, which '#' begins, off the start.
void
skipBlanks(std::string_view& bytes)
{
  for (;;) {
    bytes.remove_prefix(std::min(bytes.find_first_not_of(" \t\r\n"), bytes.size()));
    if (bytes.empty() || bytes[0] != '#')
      return;
    bytes.remove_prefix(std::min(bytes.find_first_of("\r\n"), bytes.size()));
  }
}

/// The next number of a PGM, if there is one.
std::optional<std::uint64_t>
takePgmNumber(std::string_view& bytes)
{
  skipBlanks(bytes);
  const std::size_t length =
      std::min(bytes.find_first_not_of("0123456789"), bytes.size());
  const auto value = parseCount(bytes.substr(0, length));
  bytes.remove_prefix(length);
  return value;
}

std::uint64_t
takeHeaderNumber(std::string_view& bytes)
{
  const auto value = takePgmNumber(bytes);
  if (!value)
    throw std::runtime_error("corrupt PGM header");
  return *value;
}

[[noreturn]] void
throwTooShort(const DepthImage& image)
{
  throw std::runtime_error(fmt::format("PGM: truncated: too short for {} x {} pixels",
                                       image.width,
                                       image.height));
}

/// P5: two bytes per pixel, big endian.
void
readBinaryPixels(std::string_view bytes, std::size_t n, DepthImage& image)
{
  if (bytes.empty() || 2 * n > bytes.size() - 1)
    throwTooShort(image);
  bytes.remove_prefix(1); // the blank behind the header
  image.pixels.resize(n);
  const ScalarType pixel{'U', 2};
  for (std::size_t i = 0; i < n; ++i)
    image.pixels[i] =
        static_cast<std::uint16_t>(pixel.read(bytes.data() + 2 * i, true));
  if (bytes.size() > 2 * n)
    image.notices.push_back(
        fmt::format("{} bytes behind the last pixel: not used", bytes.size() - 2 * n));
}

/// P2: numbers in words.
void
readTextPixels(std::string_view bytes,
               std::size_t n,
               std::uint64_t maximum,
               DepthImage& image)
{
  // Every pixel takes a digit and a blank at least.
  if (n > bytes.size() / 2)
    throwTooShort(image);
  image.pixels.resize(n);
  for (std::uint16_t& pixel : image.pixels) {
    const auto value = takePgmNumber(bytes);
    if (!value && bytes.empty())
      throwTooShort(image);
    if (!value || *value > maximum)
      throw std::runtime_error("PGM: corrupt: a pixel is not a number up to " +
                               std::to_string(maximum));
    pixel = static_cast<std::uint16_t>(*value);
  }
  skipBlanks(bytes);
  if (!bytes.empty())
    image.notices.push_back(
        fmt::format("{} bytes behind the last pixel: not used", bytes.size()));
}

} // namespace

DepthImage
readPng(std::string_view bytes, std::uint64_t max_points)
{
  PngInput input{bytes, max_points, {}};
  DepthImage image;
  png_structp png =
      png_create_read_struct(PNG_LIBPNG_VER_STRING, &input, keepError, ignoreWarning);
  png_infop info = png != nullptr ? png_create_info_struct(png) : nullptr;
  if (info == nullptr)
    input.error = "out of memory";
  else
    decode(png, info, input, image);
  png_destroy_read_struct(&png, &info, nullptr);
  if (!input.error.empty())
    throw std::runtime_error("PNG: " + input.error);
  checkPointCount(static_cast<std::uint64_t>(image.width) *
                      static_cast<std::uint64_t>(image.height),
                  max_points);
  if (!input.bytes.empty())
    image.notices.push_back(
        fmt::format("{} bytes behind the image: not used", input.bytes.size()));
  return image;
}

DepthImage
readPgm(std::string_view bytes, std::uint64_t max_points)
{
  const bool is_text = bytes.substr(0, 2) == "P2";
  bytes.remove_prefix(std::min<std::size_t>(2, bytes.size()));
  const std::uint64_t width = takeHeaderNumber(bytes);
  const std::uint64_t height = takeHeaderNumber(bytes);
  const std::uint64_t maximum = takeHeaderNumber(bytes);
  if (maximum < 256 || maximum > 65535)
    throw std::runtime_error("PGM: not 16-bit gray, so no depth image");
  constexpr std::uint64_t kLargest = 0x7fffffff;
  const auto n = product(width, height);
  if (width > kLargest || height > kLargest || !n || *n > kLargest)
    throw std::runtime_error("PGM: impossibly large");
  checkPointCount(*n, max_points);
  DepthImage image;
  image.width = static_cast<int>(width);
  image.height = static_cast<int>(height);
  if (is_text)
    readTextPixels(bytes, *n, maximum, image);
  else
    readBinaryPixels(bytes, *n, image);
  return image;
}

} // namespace holdfast::io
