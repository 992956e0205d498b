#include "dense_output.h"

#include "console.h"
#include "dense_layers.h"
#include "patch_output.h"
#include "summary.h"

#include <holdfast/io/atomic_file.h>
#include <holdfast/io/patch_io.h>

#include <algorithm>
#include <filesystem>
#include <list>
#include <vector>

namespace holdfast::app {

void
writeDenseFiles(const DenseReport& report,
                const std::string& folder,
                const std::string& stem)
{
  makeFolder(folder);
  const std::string base = (std::filesystem::path(folder) / stem).string();
  const DenseExtraction& dense = report.dense;
  std::list<AtomicFile> files;
  std::vector<AtomicFile*> together;
  const auto open = [&](const std::string& ending) -> std::ostream& {
    together.push_back(&files.emplace_back(base + ending));
    return files.back().stream();
  };
  writePatchPoints(open(".dense.pcd"), dense, report.sensor_pose, report.offset);
  for (const Layer& layer : layersOf(dense, report.sensor_pose)) {
    writePfm(open("." + layer.name + ".pfm"), layer, dense.width, dense.height);
    pictureOf(layer, dense.width, dense.height)
        .writePng(open("." + layer.name + ".png"));
  }
  AtomicFile::commit(together);
}

std::string
denseSummary(const DenseReport& report, double load_ms, double fit_ms)
{
  const DenseExtraction& dense = report.dense;
  const auto& attempts = dense.result.patches;
  const auto patches = std::count_if(attempts.begin(), attempts.end(), isAccepted);
  const std::string rejected = rejectedText(dense.result);
  return report.cloud + ": " + std::to_string(dense.width) + " x " +
         std::to_string(dense.height) + " attempts, every " +
         (dense.stride == 1 ? "pixel" : std::to_string(dense.stride) + " pixels") +
         ": " + std::to_string(patches) + " patches, sensor " +
         dense.result.sensor.name + ", loaded in " + formatNumber("%.0f", load_ms) +
         " ms, fitted in " + formatNumber("%.1f", fit_ms) + " ms\n" +
         (rejected.empty() ? "" : "rejected: " + rejected + "\n");
}

} // namespace holdfast::app
