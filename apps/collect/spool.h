/// \file Rows on their way into columns, in a file that a killed process can go on
/// with.
#pragma once

#include "result_folder.h"

#include <cstdint>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

namespace holdfast::app {

/// A plain file: source after source, in their order, as bytes of this machine. HDF5
/// could not be written on where a process was killed; this can, behind the last source
/// that is complete.
class Spool {
public:
  /// Goes on with what is there as far as it is of the same sources, in the same state,
  /// and begins anew otherwise. \throw std::runtime_error "PATH: cause", also when
  /// another process is at it.
  Spool(std::string path, const std::vector<ResultSource>& sources);
  ~Spool();
  Spool(const Spool&) = delete;
  Spool& operator=(const Spool&) = delete;

  /// How many of the sources are in it.
  std::size_t complete() const
  {
    return complete_;
  }

  /// Reads the next source into it. \throw std::runtime_error as readSource(); what was
  /// written of it is taken back.
  void add(const ResultSource& source);

  /// Says that the next source is no result. Not to be read again.
  void skip(const ResultSource& source);

  /// All that is complete, from the start.
  void replay(const ResultSink& sink);

  /// Deletes the file.
  void remove();

private:
  struct Stream;
  std::string path_;
  std::unique_ptr<Stream> stream_;
  std::size_t complete_ = 0;
  std::uint64_t end_ = 0; ///< of the last complete source, bytes
};

} // namespace holdfast::app
