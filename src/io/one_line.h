/// \file Words of a file in messages about it.
#pragma once

#include <algorithm>
#include <string>

namespace holdfast::io {

/// The text with '?' for control characters: a quoted word of YAML may hold line ends,
/// and a message is one line.
inline std::string
oneLine(std::string text)
{
  const auto is_control = [](char c) { return (c >= 0 && c < ' ') || c == '\x7f'; };
  std::replace_if(text.begin(), text.end(), is_control, '?');
  return text;
}

} // namespace holdfast::io
