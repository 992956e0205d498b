#include "lzf.h"

#include <array>
#include <cstdint>
#include <cstring>

namespace holdfast::io {
namespace {

constexpr std::size_t kLongestLiteral = 32;
constexpr std::size_t kShortestCopy = 3;
constexpr std::size_t kLongestCopy = 264;
constexpr std::size_t kFarthest = 8192; ///< bytes before

std::uint8_t
byteAt(const char* p)
{
  return static_cast<std::uint8_t>(*p);
}

// ---- compression ----

void
appendLiterals(std::string_view bytes, std::string& packed)
{
  while (!bytes.empty()) {
    const std::string_view run = bytes.substr(0, kLongestLiteral);
    packed += static_cast<char>(run.size() - 1);
    packed += run;
    bytes.remove_prefix(run.size());
  }
}

void
appendCopy(std::size_t length, std::size_t distance, std::string& packed)
{
  const std::size_t offset = distance - 1;
  const std::size_t size = length - 2;
  packed += static_cast<char>((size < 7 ? size : 7) << 5U | offset >> 8U);
  if (size >= 7)
    packed += static_cast<char>(size - 7);
  packed += static_cast<char>(offset & 0xffU);
}

std::size_t
commonLength(std::string_view plain, std::size_t a, std::size_t b)
{
  std::size_t n = 0;
  while (n < kLongestCopy && b + n < plain.size() && plain[a + n] == plain[b + n])
    ++n;
  return n;
}

/// Where the same three bytes were seen last, by a hash of them; one more than the
/// place, 0: never.
class Places {
public:
  std::size_t& operator()(const char* p)
  {
    const std::uint32_t three = static_cast<std::uint32_t>(byteAt(p)) << 16U |
                                static_cast<std::uint32_t>(byteAt(p + 1)) << 8U |
                                byteAt(p + 2);
    return places_[three * 2654435761U >> (32U - kBits)];
  }

private:
  static constexpr unsigned kBits = 14;
  std::array<std::size_t, std::size_t{1} << kBits> places_{};
};

// ---- decompression ----

/// Of the two ranges, what is left.
struct Cursor {
  const char* in;
  const char* in_end;
  char* out;
  char* out_begin;
  char* out_end;

  std::size_t inLeft() const
  {
    return static_cast<std::size_t>(in_end - in);
  }

  std::size_t outLeft() const
  {
    return static_cast<std::size_t>(out_end - out);
  }
};

/// Copies that may write up to a block too far are only made where there is room.
constexpr std::size_t kBlock = 16;

bool
copyLiterals(std::size_t length, Cursor& at)
{
  if (length > at.inLeft() || length > at.outLeft())
    return false;
  if (at.inLeft() >= kLongestLiteral && at.outLeft() >= kLongestLiteral)
    std::memcpy(at.out, at.in, kLongestLiteral); // of a fixed size: two registers
  else
    std::memcpy(at.out, at.in, length);
  at.in += length;
  at.out += length;
  return true;
}

bool
copyBack(std::size_t length, std::size_t distance, Cursor& at)
{
  if (distance > static_cast<std::size_t>(at.out - at.out_begin) ||
      length > at.outLeft())
    return false;
  const char* from = at.out - distance;
  if (distance >= kBlock && at.outLeft() >= length + kBlock)
    for (std::size_t i = 0; i < length; i += kBlock)
      std::memcpy(at.out + i, from + i, kBlock);
  else if (distance == 1)
    std::memset(at.out, *from, length);
  else
    for (std::size_t i = 0; i < length; ++i) // the ranges may overlap
      at.out[i] = from[i];
  at.out += length;
  return true;
}

/// The copy whose first byte, `control`, has been taken.
bool
takeCopy(std::uint8_t control, Cursor& at)
{
  std::size_t length = control >> 5U;
  if (at.inLeft() < (length == 7 ? 2U : 1U))
    return false;
  if (length == 7)
    length += byteAt(at.in++);
  const std::size_t distance =
      ((control & 0x1fU) << 8U | static_cast<std::size_t>(byteAt(at.in++))) + 1;
  return copyBack(length + 2, distance, at);
}

} // namespace

std::string
lzfCompress(std::string_view plain)
{
  std::string packed;
  packed.reserve(plain.size() + plain.size() / kLongestLiteral + 1);
  Places places;
  std::size_t literals = 0; // where those begin that are not written yet
  std::size_t i = 0;
  while (i + kShortestCopy <= plain.size()) {
    std::size_t& place = places(plain.data() + i);
    const std::size_t before = place;
    place = i + 1;
    const std::size_t length = before > 0 && i + 1 - before <= kFarthest ?
                                   commonLength(plain, before - 1, i) :
                                   0;
    if (length < kShortestCopy) {
      ++i;
      continue;
    }
    appendLiterals(plain.substr(literals, i - literals), packed);
    appendCopy(length, i + 1 - before, packed);
    i += length;
    literals = i;
  }
  appendLiterals(plain.substr(literals), packed);
  return packed;
}

bool
lzfDecompress(std::string_view packed, char* plain, std::size_t size)
{
  Cursor at{packed.data(), packed.data() + packed.size(), plain, plain, plain + size};
  while (at.in < at.in_end) {
    const std::uint8_t control = byteAt(at.in++);
    const bool good = control < kLongestLiteral ?
                          copyLiterals(std::size_t{control} + 1, at) :
                          takeCopy(control, at);
    if (!good)
      return false;
  }
  return at.out == at.out_end;
}

} // namespace holdfast::io
