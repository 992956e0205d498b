/// \file The results that `holdfast fit -o` leaves in a folder.
#pragma once

#include "columns/column_file.h"

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace holdfast::app {

enum class SourceKind : std::uint8_t { Json, Columns, Failure };

/// A file that says something of a cloud.
struct ResultSource {
  std::string name; ///< of the cloud's results
  std::string path;
  SourceKind kind = SourceKind::Json;
  std::uint64_t stamp = 0; ///< hash of name, size and time of the last change
};

/// By name. \throw std::runtime_error "PATH: cause" when the folder cannot be listed,
/// there is nothing of ours in it, or a cloud has two of them.
std::vector<ResultSource> resultsIn(const std::string& folder);

/// What a source holds, piece by piece, so that a large one never is in memory.
struct ResultSink {
  std::function<void(const CloudRow&)> cloud;
  std::function<void(const PatchRow*, std::size_t)> patches; ///< of the last cloud
  std::function<void(const FailedCloud&)> failure;
};

/// \throw std::runtime_error "PATH: cause" when it is no result.
void readSource(const ResultSource& source, const ResultSink& sink);

} // namespace holdfast::app
