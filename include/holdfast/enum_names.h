/// \file Names of enumerations.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string_view>

namespace holdfast {

/// Whether two words are the same name: dash and underscore are.
constexpr bool
isSameName(std::string_view a, std::string_view b)
{
  if (a.size() != b.size())
    return false;
  for (std::size_t i = 0; i < a.size(); ++i)
    if ((a[i] == '-' ? '_' : a[i]) != (b[i] == '-' ? '_' : b[i]))
      return false;
  return true;
}

/// The names of an enumeration without gaps, in its order: the one table for files,
/// options and messages. Each stands in the names.h of its enumeration's folder.
template <typename Enumeration, std::size_t N>
struct EnumNames {
  using Enum = Enumeration;

  std::array<std::string_view, N> words;

  /// \throw std::out_of_range for what is not in the enumeration.
  constexpr std::string_view of(Enum value) const
  {
    return words.at(static_cast<std::size_t>(value));
  }

  /// In either spelling, "gauss_newton" or "gauss-newton".
  constexpr std::optional<Enum> find(std::string_view name) const
  {
    for (std::size_t i = 0; i < N; ++i)
      if (isSameName(words[i], name))
        return static_cast<Enum>(i);
    return std::nullopt;
  }
};

} // namespace holdfast
