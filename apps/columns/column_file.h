/// \file Tables of patches in columns (HDF5), by the module holdfast_columns.
///
///     /patches/COLUMN    one row per patch, chunked and compressed: PatchRow
///     /clouds/COLUMN     one row per cloud: CloudRow; patches/cloud is its number
///     /settings/json     sensors and options, each once: clouds/settings is the number
///     /failed/COLUMN     clouds without results: name, path, reason
#pragma once

#include "patch_row.h"

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

namespace holdfast::app {

/// A cloud without results.
struct FailedCloud {
  std::string name;
  std::string path;
  std::string fingerprint;
  std::string reason;
};

/// A file that grows cloud by cloud.
class ColumnWriter {
public:
  virtual ~ColumnWriter() = default;

  /// A cloud, whose patches follow in addPatches(). Numbers the rows itself.
  virtual void addCloud(CloudRow cloud) = 0;
  virtual void addPatches(const PatchRow* rows, std::size_t count) = 0;
  virtual void addFailure(const FailedCloud& failed) = 0;

  /// Writes what is left and closes the file. \throw std::runtime_error in one line.
  virtual void close() = 0;
};

class ColumnReader {
public:
  virtual ~ColumnReader() = default;
  virtual const std::vector<CloudRow>& clouds() const = 0;

  /// The rows [first, first + count) of the patches, as many of them as there are.
  /// \throw std::runtime_error in one line.
  virtual void readPatches(std::size_t first,
                           std::size_t count,
                           std::vector<PatchRow>& rows) const = 0;
};

class ColumnFormat {
public:
  virtual ~ColumnFormat() = default;

  /// \param path that is overwritten. \param rows_per_chunk what is compressed
  /// together. \throw std::runtime_error in one line, as its writer does.
  virtual std::unique_ptr<ColumnWriter> create(const std::string& path,
                                               std::size_t rows_per_chunk) const = 0;

  /// \throw std::runtime_error "PATH: cause".
  virtual std::unique_ptr<ColumnReader> open(const std::string& path) const = 0;

  /// Of the first cloud in a file; empty when there is none.
  virtual std::string fingerprintOf(const std::string& path) const = 0;
};

/// \throw std::runtime_error in one line: this program was built without HDF5.
const ColumnFormat& columnFormat();

/// Writes the patches of a cloud as a file of columns that appears whole or not at all.
/// \param name of its results. \throw std::runtime_error "PATH: cause".
void writeColumns(const std::string& path,
                  const std::string& name,
                  const PatchReport& report);

} // namespace holdfast::app
