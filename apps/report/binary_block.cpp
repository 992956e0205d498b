#include "report/binary_block.h"

#include <zlib.h>

#include <array>
#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <type_traits>

namespace holdfast::app {
namespace {

template <typename Number>
const char*
typeName()
{
  return std::is_same_v<Number, float>         ? "float32" :
         std::is_same_v<Number, std::int16_t>  ? "int16" :
         std::is_same_v<Number, std::uint16_t> ? "uint16" :
                                                 "uint8";
}

std::string
toBase64(const std::vector<unsigned char>& bytes)
{
  constexpr const char* kDigits =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const auto byte = [&](std::size_t k) {
      return i + k < bytes.size() ? std::uint32_t{bytes[i + k]} : 0U;
    };
    const std::uint32_t three = byte(0) << 16U | byte(1) << 8U | byte(2);
    for (unsigned digit = 0; digit < 4; ++digit)
      text += i + digit > bytes.size() ? '=' : kDigits[three >> (18 - 6 * digit) & 63U];
  }
  return text;
}

} // namespace

template <typename Number>
nlohmann::json
BinaryBlock::add(const std::vector<Number>& numbers)
{
  const std::size_t offset = bytes_.size(), n = numbers.size();
  bytes_.resize(offset + n * sizeof(Number));
  for (std::size_t i = 0; i < n; ++i) {
    std::array<unsigned char, sizeof(Number)> bytes;
    std::memcpy(bytes.data(), &numbers[i], sizeof(Number));
    for (std::size_t k = 0; k < sizeof(Number); ++k)
      bytes_[offset + k * n + i] = bytes[k];
  }
  return {{"type", typeName<Number>()}, {"offset", offset}, {"length", n}};
}

template nlohmann::json BinaryBlock::add(const std::vector<float>&);
template nlohmann::json BinaryBlock::add(const std::vector<std::int16_t>&);
template nlohmann::json BinaryBlock::add(const std::vector<std::uint16_t>&);
template nlohmann::json BinaryBlock::add(const std::vector<std::uint8_t>&);

std::string
BinaryBlock::base64() const
{
  uLongf size = compressBound(static_cast<uLong>(bytes_.size()));
  std::vector<unsigned char> packed(size);
  if (compress2(packed.data(),
                &size,
                bytes_.data(),
                static_cast<uLong>(bytes_.size()),
                Z_BEST_COMPRESSION) != Z_OK)
    throw std::runtime_error("no memory to compress the data of the page");
  packed.resize(size);
  return toBase64(packed);
}

} // namespace holdfast::app
