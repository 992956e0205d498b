#include "package_files.h"

#include <algorithm>
#include <filesystem>
#include <set>

namespace holdfast::python {

namespace fs = std::filesystem;

std::string&
packageFolder()
{
  static std::string folder;
  return folder;
}

std::string
foundInPackage(const std::string& kind,
               const std::vector<std::string>& known,
               const std::string& name_or_path)
{
  const fs::path here = fs::path(packageFolder()) / kind / (name_or_path + ".yaml");
  std::error_code ignored;
  const bool is_named = fs::path(name_or_path).filename() == name_or_path &&
                        !fs::exists(name_or_path, ignored) &&
                        std::count(known.begin(), known.end(), name_or_path) == 0;
  return is_named && fs::is_regular_file(here, ignored) ? here.string() : name_or_path;
}

std::vector<std::string>
builtInNames(const std::string& kind, const std::vector<std::string>& known)
{
  std::set<std::string> names(known.begin(), known.end());
  std::error_code ignored;
  for (const fs::directory_entry& entry :
       fs::directory_iterator(fs::path(packageFolder()) / kind, ignored))
    if (entry.path().extension() == ".yaml")
      names.insert(entry.path().stem().string());
  return {names.begin(), names.end()};
}

} // namespace holdfast::python
