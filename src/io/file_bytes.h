/// \file All bytes of a file, before anyone knows what they are.
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

namespace holdfast::io {

struct FileBytes {
  std::string text; ///< of a stream
  std::unique_ptr<char[]> block; ///< of a file; not filled with zeros first
  std::size_t block_size = 0;

  std::string_view view() const
  {
    return block ? std::string_view(block.get(), block_size) : std::string_view(text);
  }
};

/// Reads a file or pipe, or standard input for "-".
/// \param wanted what it should be, for messages: "a cloud".
/// \throw std::runtime_error with the cause alone, also when there is nothing in it.
FileBytes readBytes(const std::string& path, const std::string& wanted);

/// What a file is that may be found in the place of any other: a web page, a pointer to
/// a file kept elsewhere, something packed. To be put behind "is ".
std::optional<std::string_view> nameOfStranger(std::string_view bytes);

} // namespace holdfast::io
