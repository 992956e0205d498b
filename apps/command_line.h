/// \file What the options of the sub-commands have in common.
#pragma once

#include <holdfast/patch/names.h>

#include <CLI/CLI.hpp>

#include <charconv>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

namespace holdfast::app {

/// The whole text as a number, in the classic locale; nothing for another text.
template <typename Number>
std::optional<Number>
parseNumber(std::string_view text)
{
  // from_chars takes no plus sign.
  if (text.size() > 1 && text[0] == '+' && text[1] != '-')
    text.remove_prefix(1);
  Number value{};
  const char* end = text.data() + text.size();
  const auto result = std::from_chars(text.data(), end, value);
  if (result.ec != std::errc() || result.ptr != end)
    return std::nullopt;
  return value;
}

/// Accepts positive finite numbers; `unit` is shown in the help.
CLI::Validator positiveNumber(const std::string& unit);

/// The same and zero.
CLI::Validator nonNegativeNumber(const std::string& unit);

/// Shortens what the help says behind each option to "VALUES [DEFAULT]". To be called
/// when all options are there.
void tidyHelp(CLI::App& command);

/// Makes each of `others` an error together with `option`.
void exclude(CLI::App& command,
             const std::string& option,
             const std::vector<std::string>& others);

/// Accepts what `isKnown` does; `words` are shown in the help and when it does not.
template <typename Words>
CLI::Validator
oneOf(const Words& words, const std::function<bool(const std::string&)>& is_known)
{
  std::string list;
  for (const auto& word : words)
    list += (list.empty() ? "{" : ",") + std::string(word);
  list += '}';
  return CLI::Validator(
      [list, is_known](const std::string& text) {
        return is_known(text) ? std::string() : text + " not in " + list;
      },
      list);
}

/// An option whose values are those of an enumeration; `value` may be an optional.
/// \param names its table (patch/names.h); each may be written with dashes, too
/// \param also a short word for one of them
template <typename Names, typename Value>
CLI::Option*
addChoice(CLI::App& command,
          const std::string& name,
          Value& value,
          const Names& names,
          const std::string& description,
          const std::pair<std::string, typename Names::Enum>& also = {})
{
  const auto find =
      [names, also](const std::string& word) -> std::optional<typename Names::Enum> {
    if (!word.empty() && word == also.first)
      return also.second;
    return names.find(word);
  };
  return command
      .add_option_function<std::string>(
          name,
          [&value, find](const std::string& word) { value = find(word).value(); },
          description)
      ->type_name("")
      ->check(oneOf(names.words, [find](const std::string& word) {
        return find(word).has_value();
      }));
}

} // namespace holdfast::app
