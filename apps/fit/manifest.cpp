#include "manifest.h"

#include "command_line.h"
#include "hash.h"

#include <fmt/format.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <unordered_map>

namespace holdfast::app {
namespace {

namespace fs = std::filesystem;

ManifestEntry
entryOf(const std::string& line)
{
  const std::size_t tab = line.find('\t');
  if (tab == std::string::npos)
    return {line, fs::path(line).stem().string()};
  return {line.substr(0, tab), line.substr(tab + 1)};
}

bool
isFileName(const std::string& name)
{
  return !name.empty() && name[0] != '.' &&
         name.find_first_of("/\t") == std::string::npos;
}

} // namespace

std::vector<ManifestEntry>
readManifest(const std::string& path)
{
  std::error_code ignored;
  if (fs::is_directory(path, ignored))
    throw std::runtime_error(path + ": is a folder, no list of clouds");
  errno = 0;
  std::ifstream file(path);
  if (!file)
    throw std::runtime_error(path + ": cannot be read: " + std::strerror(errno));
  std::vector<ManifestEntry> entries;
  std::unordered_map<std::string, std::size_t> line_of_name;
  std::size_t number = 0;
  for (std::string line; std::getline(file, line);) {
    ++number;
    if (constexpr std::string_view kByteOrderMark = "\xef\xbb\xbf";
        number == 1 && line.compare(0, kByteOrderMark.size(), kByteOrderMark) == 0)
      line.erase(0, kByteOrderMark.size());
    if (!line.empty() && line.back() == '\r')
      line.pop_back();
    if (line.empty() || line[0] == '#')
      continue;
    ManifestEntry entry = entryOf(line);
    if (entry.path.empty() || !isFileName(entry.name))
      throw std::runtime_error(fmt::format("{}: line {}: '{}' is no name for results",
                                           path,
                                           number,
                                           entry.name));
    const auto [first, is_new] = line_of_name.emplace(entry.name, number);
    if (!is_new)
      throw std::runtime_error(
          fmt::format("{}: lines {} and {} would both write results called {}; a name "
                      "of its own goes behind a tab",
                      path,
                      first->second,
                      number,
                      entry.name));
    entries.push_back(std::move(entry));
  }
  if (file.bad())
    throw std::runtime_error(path + ": cannot be read to its end");
  if (entries.empty())
    throw std::runtime_error(path + ": lists no cloud");
  return entries;
}

std::optional<Shard>
parseShard(std::string_view text)
{
  const std::size_t slash = text.find('/');
  if (slash == std::string_view::npos)
    return std::nullopt;
  const auto number = parseNumber<std::size_t>(text.substr(0, slash));
  const auto count = parseNumber<std::size_t>(text.substr(slash + 1));
  if (!number || !count || *number < 1 || *number > *count)
    return std::nullopt;
  return Shard{*number - 1, *count};
}

bool
isOf(const Shard& shard, std::string_view name)
{
  return stableHash(name) % shard.count == shard.index;
}

std::vector<ManifestEntry>
shardOf(const std::vector<ManifestEntry>& entries, const Shard& shard)
{
  std::vector<ManifestEntry> own;
  for (const ManifestEntry& entry : entries)
    if (isOf(shard, entry.name))
      own.push_back(entry);
  return own;
}

} // namespace holdfast::app
