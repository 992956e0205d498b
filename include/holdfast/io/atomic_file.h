/// \file Output files that appear whole or not at all.
#pragma once

#include <fstream>
#include <string>

namespace holdfast {

/// A file that is written under a temporary name in the same folder and takes its own
/// name in commit(). Without commit() it vanishes, and a file that had the name before
/// stays as it was. Devices and pipes, such as /dev/null, are written directly.
class AtomicFile {
public:
  /// \throw std::runtime_error "PATH: cause" when the file cannot be created.
  explicit AtomicFile(std::string path);
  ~AtomicFile();
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  std::ostream& stream()
  {
    return stream_;
  }

  /// \throw std::runtime_error "PATH: cause" when something could not be written.
  void commit();

private:
  std::string path_;
  std::string target_; ///< where path_ leads
  std::string temporary_; ///< empty when there is nothing to rename or remove
  std::ofstream stream_;
};

} // namespace holdfast
