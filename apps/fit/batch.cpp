#include "batch.h"

#include "batch_files.h"
#include "console.h"
#include "patch_output.h"

#include "columns/column_file.h"

#include <fmt/format.h>

#include <iostream>
#include <new>
#include <stdexcept>
#include <system_error>
#include <variant>
#include <vector>

namespace holdfast::app {
namespace {

struct Counts {
  std::size_t fitted = 0;
  std::size_t failed = 0;
  std::size_t done_before = 0;
  std::size_t failed_before = 0;
};

/// The report of a cloud, or why there is none.
using Attempt = std::variant<PatchReport, std::string>;

/// \throw std::runtime_error where no cloud is to blame.
Attempt
attempt(const std::string& path,
        const std::function<PatchReport(const std::string&)>& fit)
{
  try {
    return fit(path);
  }
  catch (const std::bad_alloc&) {
    return path + ": not enough memory";
  }
  catch (const std::system_error& error) {
    if (error.code() == std::errc::resource_unavailable_try_again)
      throw std::runtime_error(path + ": the system has no more threads to give");
    return std::string(error.what());
  }
  catch (const std::exception& error) {
    return std::string(error.what());
  }
}

void
fitEntry(const ManifestEntry& entry,
         const BatchFiles& files,
         const FitSettings& settings,
         const std::function<PatchReport(const std::string&)>& fit,
         Counts& counts)
{
  const Attempt made = attempt(entry.path, fit);
  if (const auto* report = std::get_if<PatchReport>(&made)) {
    files.write(*report);
    ++counts.fitted;
    return;
  }
  const std::string& reason = std::get<std::string>(made);
  printError(reason);
  files.writeFailure(entry.path, settings.fingerprint, reason);
  ++counts.failed;
}

/// \return true when nothing is left to do.
bool
isLeft(const BatchFiles& files, const FitSettings& settings, Counts& counts)
{
  if (!settings.resume)
    return false;
  const CloudState state = files.state(settings.fingerprint);
  if (state == CloudState::Done) {
    files.keepResults();
    ++counts.done_before;
    return true;
  }
  if (state == CloudState::Failed && !settings.retry_failed) {
    ++counts.failed_before;
    return true;
  }
  return false;
}

std::string
summary(const FitSettings& settings, std::size_t clouds, const Counts& counts)
{
  return fmt::format("{}, part {} of {}: {} clouds: {} fitted, {} failed; before: {} "
                     "fitted, {} failed\n",
                     settings.manifest,
                     settings.shard.index + 1,
                     settings.shard.count,
                     clouds,
                     counts.fitted,
                     counts.failed,
                     counts.done_before,
                     counts.failed_before);
}

} // namespace

int
runBatch(const FitSettings& settings,
         const std::function<PatchReport(const std::string&)>& fit)
{
  const std::vector<ManifestEntry> entries =
      shardOf(readManifest(settings.manifest), settings.shard);
  checkFolder(settings.output_folder);
  makeFolder(settings.output_folder);
  if (settings.format == BatchFormat::Columns)
    columnFormat(); // rather than after the first cloud
  ProgressBar bar("fitting", !settings.quiet);
  Counts counts;
  int number = 0;
  for (const ManifestEntry& entry : entries) {
    const BatchFiles files(settings.output_folder, entry.name, settings.format);
    if (!isLeft(files, settings, counts))
      fitEntry(entry, files, settings, fit, counts);
    bar.update(++number, static_cast<int>(entries.size()));
  }
  if (!settings.quiet)
    std::cout << summary(settings, entries.size(), counts) << std::flush;
  return counts.failed + counts.failed_before > 0 ? 2 : 0;
}

} // namespace holdfast::app
