/// \file Arrays of numbers as text in a page.
#pragma once

#include <nlohmann/json.hpp>

#include <cstddef>
#include <string>
#include <vector>

namespace holdfast::app {

/// Typed arrays one behind the other. The bytes of each are sorted by their place in a
/// number, first bytes first, which makes numbers of the same size compress.
class BinaryBlock {
public:
  /// \return where the array is, for the reader: {"type": "float32", "offset": bytes,
  /// "length": numbers}. Numbers are float, std::int16_t, std::uint16_t or
  /// std::uint8_t.
  template <typename Number>
  nlohmann::json add(const std::vector<Number>& numbers);

  /// All of them as a zlib stream, in base64.
  /// \throw std::runtime_error when there is no memory for it.
  std::string base64() const;

private:
  std::vector<unsigned char> bytes_;
};

} // namespace holdfast::app
