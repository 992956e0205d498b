/// \file What the options of the sub-commands have in common.
#pragma once

#include <CLI/CLI.hpp>

#include <string>
#include <utility>
#include <vector>

namespace holdfast::app {

/// Accepts positive finite numbers; `unit` is shown in the help.
CLI::Validator positiveNumber(const std::string& unit);

/// Shortens what the help says behind each option to "VALUES [DEFAULT]". To be called
/// when all options are there.
void tidyHelp(CLI::App& command);

/// Makes each of `others` an error together with `option`.
void exclude(CLI::App& command,
             const std::string& option,
             const std::vector<std::string>& others);

/// What the user writes, and what it means.
template <typename Enum>
using Choices = std::vector<std::pair<std::string, Enum>>;

/// An option whose values have names; `value` may be an optional.
template <typename Enum, typename Value>
CLI::Option*
addChoice(CLI::App& command,
          const std::string& name,
          Value& value,
          const Choices<Enum>& choices,
          const std::string& description)
{
  std::vector<std::string> names;
  for (const auto& choice : choices)
    names.push_back(choice.first);
  const auto assign = [&value, &choices](const std::string& chosen) {
    for (const auto& [choice, meaning] : choices)
      if (choice == chosen)
        value = meaning;
  };
  return command.add_option_function<std::string>(name, assign, description)
      ->type_name("")
      ->check(CLI::IsMember(names));
}

} // namespace holdfast::app
