#include "command_line.h"

#include <cmath>

namespace holdfast::app {

CLI::Validator
positiveNumber(const std::string& unit)
{
  return CLI::Validator(
      [](const std::string& text) {
        const auto value = parseNumber<double>(text);
        return value && std::isfinite(*value) && *value > 0.0 ?
                   std::string() :
                   text + " is not a positive number";
      },
      unit);
}

CLI::Validator
nonNegativeNumber(const std::string& unit)
{
  return CLI::Validator(
      [](const std::string& text) {
        const auto value = parseNumber<double>(text);
        return value && std::isfinite(*value) && *value >= 0.0 ?
                   std::string() :
                   text + " is neither 0 nor a positive number";
      },
      unit);
}

void
exclude(CLI::App& command,
        const std::string& option,
        const std::vector<std::string>& others)
{
  for (const std::string& other : others)
    command.get_option(option)->excludes(command.get_option(other));
}

void
tidyHelp(CLI::App& command)
{
  for (CLI::Option* option : command.get_options()) {
    // CLI11 writes TYPE:CHECK; the type is empty where the check says it all.
    std::string text = option->get_type_name();
    if (!text.empty() && text[0] == ':')
      text.erase(0, 1);
    if (!option->get_default_str().empty())
      text += " [" + option->get_default_str() + "]";
    if (!option->get_positional())
      option->option_text(text);
  }
}

} // namespace holdfast::app
