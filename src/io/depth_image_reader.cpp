#include "cloud_readers.h"

#include <png.h>

#include <algorithm>
#include <csetjmp>

namespace holdfast::io {
namespace {

/// Where libpng reads from, and what it had to say.
struct PngInput {
  std::string_view bytes;
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

/// The next number of a PGM header; '#' begins a comment.
std::uint64_t
takeHeaderNumber(std::string_view& bytes)
{
  for (;;) {
    bytes.remove_prefix(std::min(bytes.find_first_not_of(" \t\r\n"), bytes.size()));
    if (bytes.empty() || bytes[0] != '#')
      break;
    takeLine(bytes);
  }
  const std::size_t length =
      std::min(bytes.find_first_not_of("0123456789"), bytes.size());
  const auto value = parseCount(bytes.substr(0, length));
  if (!value)
    throw std::runtime_error("corrupt PGM header");
  bytes.remove_prefix(length);
  return *value;
}

} // namespace

DepthImage
readPng(std::string_view bytes)
{
  PngInput input{bytes, {}};
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
  return image;
}

DepthImage
readPgm(std::string_view bytes)
{
  bytes.remove_prefix(std::min<std::size_t>(2, bytes.size()));
  const std::uint64_t width = takeHeaderNumber(bytes);
  const std::uint64_t height = takeHeaderNumber(bytes);
  const std::uint64_t maximum = takeHeaderNumber(bytes);
  if (maximum < 256 || maximum > 65535)
    throw std::runtime_error("PGM: not 16-bit gray, so no depth image");
  if (bytes.empty())
    throw std::runtime_error("PGM: truncated header");
  bytes.remove_prefix(1);
  const auto size = product(width, height, 2);
  if (!size || *size > bytes.size())
    throw std::runtime_error("PGM: truncated: too short for " + std::to_string(width) +
                             " x " + std::to_string(height) + " pixels");
  if (bytes.size() > *size)
    throw std::runtime_error("PGM: corrupt: more pixels than the header announces");
  DepthImage image;
  image.width = static_cast<int>(width);
  image.height = static_cast<int>(height);
  image.pixels.resize(width * height);
  const ScalarType pixel{'U', 2};
  for (std::size_t i = 0; i < image.pixels.size(); ++i) // big endian
    image.pixels[i] =
        static_cast<std::uint16_t>(pixel.read(bytes.data() + 2 * i, true));
  return image;
}

} // namespace holdfast::io
