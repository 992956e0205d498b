#include "column_file.h"

#include "module.h"

#include "io/temporary_file.h"

#include <holdfast/io/patch_io.h>

#include <algorithm>
#include <stdexcept>

namespace holdfast::app {

const ColumnFormat&
columnFormat()
{
  using Function = const ColumnFormat* (*)();
  static const auto function = reinterpret_cast<Function>(
      loadModuleFunction("holdfast_columns", "holdfastColumnFormat"));
  return *function();
}

void
writeColumns(const std::string& path,
             const std::string& name,
             const PatchReport& report)
{
  const auto& patches = report.result.patches;
  try {
    io::TemporaryFile file(path);
    const auto columns =
        columnFormat().create("/proc/self/fd/" + std::to_string(file.descriptor()),
                              std::max<std::size_t>(1, patches.size()));
    columns->addCloud(cloudRowOf(name, report));
    for (const ExtractedPatch& patch : patches) {
      const PatchRow row = rowOf(patch, report.offset);
      columns->addPatches(&row, 1);
    }
    columns->close();
    file.secure();
    file.publish();
  }
  catch (const std::runtime_error& error) {
    throw std::runtime_error(path + ": " + error.what());
  }
}

} // namespace holdfast::app
