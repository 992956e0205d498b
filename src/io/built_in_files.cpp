#include "built_in_files.h"

#include <fmt/format.h>

#include <cstdlib>
#include <filesystem>
#include <set>
#include <stdexcept>
#include <system_error>

namespace holdfast::io {
namespace {

namespace fs = std::filesystem;

/// The most specific first.
std::vector<fs::path>
foldersOf(const std::string& folder)
{
  std::vector<fs::path> folders;
  if (const char* chosen = std::getenv("HOLDFAST_CONFIG_DIR"))
    folders.push_back(fs::path(chosen) / folder);
  folders.push_back(fs::path(HOLDFAST_CONFIG_DIR_INSTALL) / folder);
  folders.push_back(fs::path(HOLDFAST_CONFIG_DIR_SOURCE) / folder);
  return folders;
}

bool
isFile(const fs::path& path)
{
  std::error_code ignored;
  return fs::is_regular_file(path, ignored);
}

} // namespace

std::string
findBuiltIn(const std::string& what,
            const std::string& folder,
            const std::string& name_or_path)
{
  if (isFile(name_or_path))
    return name_or_path;
  // Anything with a separator is meant as a path, never as a name.
  if (fs::path(name_or_path).filename() == name_or_path)
    for (const fs::path& place : foldersOf(folder))
      if (isFile(place / (name_or_path + ".yaml")))
        return (place / (name_or_path + ".yaml")).string();
  if (std::error_code ignored; fs::is_directory(name_or_path, ignored))
    throw std::runtime_error(
        fmt::format("{} {}: is a folder, not a file", what, name_or_path));
  std::string known;
  for (const std::string& name : listBuiltIn(folder))
    known += (known.empty() ? "" : ", ") + name;
  throw std::runtime_error(
      fmt::format("{} {}: no such file, and no built-in {} of that name ({})",
                  what,
                  name_or_path,
                  what,
                  known));
}

std::vector<std::string>
listBuiltIn(const std::string& folder)
{
  std::set<std::string> names;
  for (const fs::path& place : foldersOf(folder)) {
    std::error_code ignored;
    for (const fs::directory_entry& entry : fs::directory_iterator(place, ignored))
      if (entry.path().extension() == ".yaml")
        names.insert(entry.path().stem().string());
  }
  return {names.begin(), names.end()};
}

} // namespace holdfast::io
