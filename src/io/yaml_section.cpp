#include "yaml_section.h"

#include "one_line.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>
#include <stdexcept>
#include <string_view>
#include <system_error>
#include <utility>

namespace holdfast::io {
namespace {

/// The whole word as a number, whatever the locale of the program; nothing for another
/// word.
template <typename Number>
std::optional<Number>
parseNumber(std::string_view word)
{
  // YAML allows a plus sign, from_chars does not.
  if (word.size() > 1 && word[0] == '+' && word[1] != '-')
    word.remove_prefix(1);
  Number value{};
  const char* end = word.data() + word.size();
  const auto result = std::from_chars(word.data(), end, value);
  if (result.ec != std::errc() || result.ptr != end)
    return std::nullopt;
  return value;
}

/// Counted from 1, also for an empty file, whose content is nowhere.
int
lineOf(const YAML::Mark& mark)
{
  return std::max(mark.line, 0) + 1;
}

/// Empty for anything but a word.
std::string
scalarOf(const YAML::Node& value)
{
  return value.IsScalar() ? value.Scalar() : std::string();
}

} // namespace

Section::Section(const YAML::Node& node, std::string file, int line, std::string path)
: file_(std::move(file)), line_(line), path_(std::move(path))
{
  if (!node.IsMap())
    failAt(line, path_.empty() ? "file" : path_, "must be a list of `key: value`");
  for (const auto& entry : node) {
    const int entry_line = lineOf(entry.first.Mark());
    if (!entry.first.IsScalar())
      failAt(entry_line,
             path_.empty() ? "file" : path_,
             "has a key that is not a name");
    const std::string& name = entry.first.Scalar();
    if (!entries_.insert({name, {entry.second, entry_line, false}}).second)
      failAt(entry_line, fullName(name), "is given twice");
  }
}

std::string
Section::text(const std::string& name)
{
  const YAML::Node value = read(name).value;
  if (!value.IsScalar() || value.Scalar().empty())
    fail(name, "must be a word");
  return value.Scalar();
}

double
Section::number(const std::string& name)
{
  const auto result = parseNumber<double>(scalar(name));
  if (!result || !std::isfinite(*result))
    fail(name, "must be a finite number");
  return *result;
}

double
Section::positive(const std::string& name)
{
  const double result = number(name);
  if (result <= 0.0)
    fail(name, "must be > 0");
  return result;
}

int
Section::pixels(const std::string& name)
{
  constexpr int kMaximum = 20000;
  const auto result = parseNumber<int>(scalar(name));
  if (!result || *result < 1 || *result > kMaximum)
    fail(name, fmt::format("must be a whole number from 1 to {}", kMaximum));
  return *result;
}

Section
Section::section(const std::string& name)
{
  const Entry& entry = read(name);
  return Section(entry.value, file_, entry.line, fullName(name));
}

std::vector<Section>
Section::list(const std::string& name)
{
  const Entry& entry = read(name);
  if (!entry.value.IsSequence())
    fail(name, "must be a list");
  std::vector<Section> sections;
  for (const YAML::Node& item : entry.value)
    sections.push_back(Section(item,
                               file_,
                               lineOf(item.Mark()),
                               fullName(name) + fmt::format("[{}]", sections.size())));
  return sections;
}

std::vector<Eigen::Vector2d>
Section::points(const std::string& name)
{
  const YAML::Node value = read(name).value;
  if (!value.IsSequence())
    fail(name, "must be a list of pairs [x, y]");
  std::vector<Eigen::Vector2d> points;
  for (const YAML::Node& item : value) {
    const bool is_pair = item.IsSequence() && item.size() == 2;
    const auto x = is_pair ? parseNumber<double>(scalarOf(item[0])) : std::nullopt;
    const auto y = is_pair ? parseNumber<double>(scalarOf(item[1])) : std::nullopt;
    if (!x || !y || !std::isfinite(*x) || !std::isfinite(*y))
      failAt(lineOf(item.Mark()),
             fullName(name) + fmt::format("[{}]", points.size()),
             "must be a pair of finite numbers [x, y]");
    points.emplace_back(*x, *y);
  }
  return points;
}

void
Section::rejectUnknown() const
{
  for (const auto& [name, entry] : entries_)
    if (!entry.used)
      fail(name, "is not a known key");
}

void
Section::fail(const std::string& name, const std::string& problem) const
{
  failAt(entries_.at(name).line, fullName(name), problem);
}

std::string
Section::fullName(const std::string& name) const
{
  return oneLine(path_.empty() ? name : path_ + "." + name);
}

const Section::Entry&
Section::read(const std::string& name)
{
  const auto found = entries_.find(name);
  if (found == entries_.end())
    failAt(line_, fullName(name), "is missing");
  found->second.used = true;
  return found->second;
}

std::string
Section::scalar(const std::string& name)
{
  return scalarOf(read(name).value);
}

void
Section::failAt(int line, const std::string& what, const std::string& problem) const
{
  throw std::runtime_error(fmt::format("{}:{}: {} {}", file_, line, what, problem));
}

Section
loadYaml(const std::string& file)
{
  try {
    return Section(YAML::LoadFile(file), file);
  }
  catch (const YAML::Exception& error) {
    throw std::runtime_error(
        fmt::format("{}:{}: {}", file, lineOf(error.mark), oneLine(error.msg)));
  }
}

} // namespace holdfast::io
