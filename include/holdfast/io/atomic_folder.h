/// \file Output folders that appear complete or not at all.
#pragma once

#include <memory>
#include <string>

namespace holdfast {

/// A folder that is filled under a temporary name beside its own and takes its own name
/// in commit(). Without commit() it vanishes.
///
/// The temporary is PATH.holdfast-partial-N. One whose writer was killed is removed by
/// the next AtomicFolder of the same path.
class AtomicFolder {
public:
  /// \param path of what is not there yet, or of an empty folder; its parent is there.
  /// \throw std::runtime_error "PATH: cause" when it is anything else, or cannot be
  /// made.
  explicit AtomicFolder(std::string path);
  ~AtomicFolder();
  AtomicFolder(const AtomicFolder&) = delete;
  AtomicFolder& operator=(const AtomicFolder&) = delete;

  /// Where to write until commit(). Files only: a folder in it would stay behind.
  const std::string& temporaryPath() const;

  /// \throw std::runtime_error "PATH: cause", also when somebody else has put something
  /// there meanwhile.
  void commit();

private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

} // namespace holdfast
