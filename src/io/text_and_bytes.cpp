#include "cloud_readers.h"

#include <algorithm>
#include <charconv>
#include <limits>

namespace holdfast::io {
namespace {

constexpr std::string_view kBlanks = " \t\r\n\v\f";

template <typename T>
double
readAs(const char* bytes)
{
  T value;
  std::memcpy(&value, bytes, sizeof(T));
  return static_cast<double>(value);
}

template <typename T>
std::optional<T>
parseWhole(std::string_view word)
{
  T value{};
  const char* end = word.data() + word.size();
  const auto result = std::from_chars(word.data(), end, value);
  if (word.empty() || result.ec != std::errc() || result.ptr != end)
    return std::nullopt;
  return value;
}

/// A number whose size double cannot hold: 0 or infinite.
double
beyondDouble(std::string_view word)
{
  const bool negative = word[0] == '-';
  const std::size_t e = word.find_first_of("eE");
  const std::string_view digits = word.substr(0, e);
  const bool small = e == std::string_view::npos ? digits.find_first_of("123456789") >
                                                       digits.find('.') : // 0.000...1
                         word.substr(e + 1, 1) == "-";
  const double size = small ? 0.0 : std::numeric_limits<double>::infinity();
  return negative ? -size : size;
}

/// The other spellings: of Microsoft's library (1.#QNAN, -1.#IND, 1.#INF, or rounded to
/// fewer digits, as 1.#R and -1.#IO) and "nan(ind)".
std::optional<double>
parseNotFinite(std::string_view word)
{
  std::string text(word.substr(0, 20));
  for (char& c : text)
    c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  const bool negative = !text.empty() && text[0] == '-';
  text.erase(0, negative ? 1 : 0);
  const auto starts = [&text](std::string_view start) {
    return text.compare(0, start.size(), start) == 0;
  };
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  if (starts("1.#inf"))
    return negative ? -kInfinity : kInfinity;
  const bool microsofts =
      starts("1.#") && text.size() > 3 && text[3] >= 'a' && text[3] <= 'z';
  if (microsofts || (starts("nan(") && text.back() == ')'))
    return std::numeric_limits<double>::quiet_NaN();
  return std::nullopt;
}

} // namespace

std::string
printable(std::string_view text)
{
  std::string shown(text.substr(0, 40));
  for (char& c : shown)
    if (c < ' ' || c > '~')
      c = '?';
  return shown;
}

std::string_view
skipToText(std::string_view bytes)
{
  constexpr std::string_view kByteOrderMark = "\xef\xbb\xbf";
  if (bytes.substr(0, kByteOrderMark.size()) == kByteOrderMark)
    bytes.remove_prefix(kByteOrderMark.size());
  bytes.remove_prefix(std::min(bytes.find_first_not_of(kBlanks), bytes.size()));
  return bytes;
}

char
lineEnd(std::string_view text)
{
  const std::size_t end = text.find_first_of("\r\n");
  const bool cr_only = end != std::string_view::npos && text[end] == '\r' &&
                       (end + 1 == text.size() || text[end + 1] != '\n');
  return cr_only ? '\r' : '\n';
}

std::optional<std::string_view>
takeLine(std::string_view& text, char line_end)
{
  if (text.empty())
    return std::nullopt;
  const std::size_t end = text.find(line_end);
  std::string_view line = text.substr(0, end);
  text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
  if (!line.empty() && line.back() == '\r')
    line.remove_suffix(1);
  return line;
}

std::string_view
takeWord(std::string_view& text)
{
  text.remove_prefix(std::min(text.find_first_not_of(kBlanks), text.size()));
  const std::string_view word = text.substr(0, text.find_first_of(kBlanks));
  text.remove_prefix(word.size());
  return word;
}

std::vector<std::string_view>
splitWords(std::string_view line)
{
  std::vector<std::string_view> words;
  for (auto word = takeWord(line); !word.empty(); word = takeWord(line))
    words.push_back(word);
  return words;
}

std::optional<double>
parseNumber(std::string_view word)
{
  // from_chars takes no plus sign.
  if (word.size() > 1 && word[0] == '+' && word[1] != '-')
    word.remove_prefix(1);
  double value = 0.0;
  const char* end = word.data() + word.size();
  const auto result = std::from_chars(word.data(), end, value);
  if (result.ec == std::errc() && result.ptr == end && !word.empty())
    return value;
  if (result.ec == std::errc::result_out_of_range && result.ptr == end)
    return beyondDouble(word);
  return parseNotFinite(word);
}

std::optional<std::uint64_t>
parseCount(std::string_view word)
{
  return parseWhole<std::uint64_t>(word);
}

std::optional<std::uint64_t>
product(std::uint64_t a, std::uint64_t b, std::uint64_t c)
{
  std::uint64_t ab = 0;
  std::uint64_t abc = 0;
  if (__builtin_mul_overflow(a, b, &ab) || __builtin_mul_overflow(ab, c, &abc))
    return std::nullopt;
  return abc;
}

bool
ScalarType::isValid() const
{
  if (kind == 'F')
    return size == 4 || size == 8;
  return (kind == 'I' || kind == 'U') &&
         (size == 1 || size == 2 || size == 4 || size == 8);
}

double
ScalarType::readOther(const char* bytes, bool swap) const
{
  char ordered[8];
  std::memcpy(ordered, bytes, static_cast<std::size_t>(size));
  if (swap)
    std::reverse(ordered, ordered + size);
  if (kind == 'F')
    return size == 4 ? readAs<float>(ordered) : readAs<double>(ordered);
  const bool is_signed = kind == 'I';
  switch (size) {
  case 1:
    return is_signed ? readAs<std::int8_t>(ordered) : readAs<std::uint8_t>(ordered);
  case 2:
    return is_signed ? readAs<std::int16_t>(ordered) : readAs<std::uint16_t>(ordered);
  case 4:
    return is_signed ? readAs<std::int32_t>(ordered) : readAs<std::uint32_t>(ordered);
  default:
    return is_signed ? readAs<std::int64_t>(ordered) : readAs<std::uint64_t>(ordered);
  }
}

} // namespace holdfast::io
