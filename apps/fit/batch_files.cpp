#include "batch_files.h"

#include "patch_output.h"

#include "columns/column_file.h"

#include <holdfast/io/atomic_file.h>
#include <holdfast/version.h>

#include <nlohmann/json.hpp>

#include <array>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <system_error>

namespace holdfast::app {
namespace {

namespace fs = std::filesystem;

constexpr const char* kRecord = ".failed.json";
constexpr const char* kColumns = ".patches.h5";
constexpr std::array<const char*, 3> kFiles{".patches.json",
                                            ".patches.pcd",
                                            ".patches.ply"};

/// The fingerprint in a JSON file of ours, which stands before anything long; empty
/// when there is none.
std::string
fingerprintIn(const std::string& path)
{
  std::ifstream file(path, std::ios::binary);
  std::string head(512, '\0');
  file.read(head.data(), static_cast<std::streamsize>(head.size()));
  head.resize(static_cast<std::size_t>(file.gcount()));
  const std::string key = "\"fingerprint\":\"";
  const std::size_t at = head.find(key);
  if (at == std::string::npos)
    return {};
  const std::size_t begin = at + key.size();
  const std::size_t end = head.find('"', begin);
  return end == std::string::npos ? std::string() : head.substr(begin, end - begin);
}

bool
exists(const std::string& path)
{
  std::error_code ignored;
  return fs::is_regular_file(path, ignored);
}

} // namespace

BatchFiles::BatchFiles(const std::string& folder,
                       const std::string& name,
                       BatchFormat format)
: folder_(folder), name_(name), format_(format)
{}

std::string
BatchFiles::path(const char* ending) const
{
  return (fs::path(folder_) / (name_ + ending)).string();
}

bool
BatchFiles::hasResults(const std::string& fingerprint) const
{
  if (format_ == BatchFormat::Columns)
    return exists(path(kColumns)) &&
           columnFormat().fingerprintOf(path(kColumns)) == fingerprint;
  for (const char* ending : kFiles)
    if (!exists(path(ending)))
      return false;
  return fingerprintIn(path(kFiles[0])) == fingerprint;
}

CloudState
BatchFiles::state(const std::string& fingerprint) const
{
  if (hasResults(fingerprint))
    return CloudState::Done;
  const std::string record = path(kRecord);
  return exists(record) && fingerprintIn(record) == fingerprint ? CloudState::Failed :
                                                                  CloudState::Open;
}

void
BatchFiles::removeOthers(const std::vector<const char*>& endings) const
{
  for (const char* ending : endings) {
    std::error_code error;
    fs::remove(path(ending), error);
    if (error)
      throw std::runtime_error(path(ending) +
                               ": cannot be removed: " + error.message());
  }
}

void
BatchFiles::keepResults() const
{
  if (format_ == BatchFormat::Columns)
    removeOthers({kRecord, kFiles[0], kFiles[1], kFiles[2]});
  else
    removeOthers({kRecord, kColumns});
}

void
BatchFiles::write(const PatchReport& report) const
{
  if (format_ == BatchFormat::Columns)
    writeColumns(path(kColumns), name_, report);
  else
    writePatchFiles(report, folder_, name_);
  keepResults();
}

void
BatchFiles::writeFailure(const std::string& cloud,
                         const std::string& fingerprint,
                         const std::string& reason) const
{
  // Results of former options first: beside the record they would pass for current
  // ones.
  removeOthers({kFiles[0], kFiles[1], kFiles[2], kColumns});
  const nlohmann::ordered_json record = {{"holdfast", HOLDFAST_VERSION},
                                         {"fingerprint", fingerprint},
                                         {"name", name_},
                                         {"cloud", cloud},
                                         {"reason", reason}};
  AtomicFile file(path(kRecord));
  file.stream() << record.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace)
                << '\n';
  file.commit();
}

} // namespace holdfast::app
