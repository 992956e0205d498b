/// \file Output files that appear whole or not at all.
#pragma once

#include <iosfwd>
#include <memory>
#include <string>
#include <vector>

namespace holdfast {

/// A file that is written under a temporary name in the same folder and takes its own
/// name in commit(), once its content is on the disk. Without commit() it vanishes, and
/// a file that had the name before stays as it was.
///
/// The temporary, NAME.holdfast-partial-N, is new, never one that was there before:
/// several writers of one file do not mix, the last to commit wins. One whose writer
/// was killed is removed by the next AtomicFile of the same name. A file that is
/// replaced hands on its permissions and, where the system allows it, its owner. A
/// symbolic link stays one: what it leads to is written, also where that does not exist
/// yet. Devices and pipes, such as /dev/null, are written directly.
class AtomicFile {
public:
  /// \throw std::runtime_error "PATH: cause" when the file cannot be created.
  explicit AtomicFile(std::string path);
  ~AtomicFile();
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  /// Writes numbers in the classic locale, whatever that of the program is.
  std::ostream& stream();

  /// \throw std::runtime_error "PATH: cause" when something could not be written.
  void commit();

  /// Commits files that belong together: none appears before all are on the disk.
  static void commit(const std::vector<AtomicFile*>& files);

private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

/// Removes what this process has begun to write as AtomicFile and not committed. May be
/// called by a handler of a signal that ends the program, from any thread; the library
/// itself installs no handler.
void removeTemporaryFiles() noexcept;

} // namespace holdfast
