#include "patch_output.h"

#include <holdfast/io/atomic_file.h>

#include <unistd.h>

#include <filesystem>
#include <stdexcept>

namespace holdfast::app {

namespace fs = std::filesystem;

void
checkFolder(const std::string& folder)
{
  fs::path existing = fs::absolute(folder);
  std::error_code ignored;
  while (!fs::exists(existing, ignored) && existing.has_relative_path())
    existing = existing.parent_path();
  if (!fs::is_directory(existing, ignored))
    throw std::runtime_error(existing.string() + ": is not a folder");
  if (::access(existing.c_str(), W_OK | X_OK) != 0)
    throw std::runtime_error(existing.string() + ": cannot be written to");
}

void
makeFolder(const std::string& folder)
{
  std::error_code error;
  fs::create_directories(folder, error);
  if (error)
    throw std::runtime_error(folder + ": cannot be created: " + error.message());
}

void
writePatchFiles(const PatchReport& report,
                const std::string& folder,
                const std::string& stem)
{
  makeFolder(folder);
  const fs::path base = fs::path(folder) / stem;
  AtomicFile json(base.string() + ".patches.json");
  AtomicFile points(base.string() + ".patches.pcd");
  AtomicFile mesh(base.string() + ".patches.ply");
  writeJson(json.stream(), report, JsonLayout::PatchPerLine);
  writePatchPoints(points.stream(),
                   report.result.patches,
                   report.sensor_pose,
                   report.offset);
  writeMesh(mesh.stream(), report.result.patches, false, report.offset);
  AtomicFile::commit(std::vector<AtomicFile*>{&points, &mesh, &json});
}

} // namespace holdfast::app
