/// \file Files under temporary names that become others, or vanish.
#pragma once

#include <string>

namespace holdfast::io {

/// A new, empty file beside `target`, locked for as long as it is written, so that
/// others can tell it from what a killed writer has left. \throw std::system_error
class TemporaryFile {
public:
  explicit TemporaryFile(const std::string& target);
  ~TemporaryFile(); ///< removes it, unless it was published
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;

  int descriptor() const
  {
    return descriptor_;
  }

  /// Waits until the content is on the disk.
  void secure();

  /// Takes the target's name, and its permissions if there is one.
  void publish();

private:
  void create();
  void drop();

  std::string target_;
  std::string path_;
  int descriptor_ = -1;
  int entry_ = -1; ///< in the list of what to remove
};

/// The name that the n-th writer of `target` uses meanwhile.
std::string temporaryName(const std::string& target, int n);

/// \param error of the system \throw std::runtime_error that names path and cause
[[noreturn]] void failToWrite(const std::string& path, int error);

/// Removes all that were not published. Async-signal-safe.
void removeAllTemporaries() noexcept;

} // namespace holdfast::io
