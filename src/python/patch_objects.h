/// \file Patches as Python has them.
#pragma once

#include <holdfast/pcl/patch_extraction.h>

#include <pybind11/pybind11.h>

#include <memory>
#include <utility>
#include <vector>

namespace holdfast::python {

namespace py = pybind11;

/// A patch, or how the attempt at one ended. Shares the memory of those it came with.
struct PatchObject {
  std::shared_ptr<const ExtractedPatch> patch;
};

/// What several patches have in common.
struct PatchSource {
  ExtractionOptions options;
  Pose sensor_pose;
  bool covariances_of_cloud = true;
  /// All but its patches, which are beside it.
  ExtractionResult result;
};

/// Patches, and arrays of what they have, made when they are first asked for.
struct PatchesObject {
  using List = std::vector<std::shared_ptr<const ExtractedPatch>>;

  explicit PatchesObject(std::vector<ExtractedPatch> patches,
                         std::shared_ptr<const PatchSource> the_source = {});
  PatchesObject(List the_list, std::shared_ptr<const PatchSource> the_source)
  : list(std::move(the_list)), source(std::move(the_source))
  {}

  List list;
  std::shared_ptr<const PatchSource> source; ///< null: fits of separate points
  py::dict columns; ///< read-only arrays by name
};

} // namespace holdfast::python
