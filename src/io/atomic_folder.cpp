#include "temporary_file.h"

#include <holdfast/io/atomic_folder.h>

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <stdexcept>
#include <system_error>
#include <utility>

namespace holdfast {
namespace {

namespace fs = std::filesystem;

/// The path itself, not of a link to it, without slashes at its end.
/// \throw std::runtime_error when something is there already.
std::string
freePath(const std::string& path)
{
  std::error_code error;
  if (path.empty())
    io::failToWrite(path, ENOENT);
  if (!fs::exists(path, error)) {
    const std::string::size_type end = path.find_last_not_of('/');
    return path.substr(0, end + 1);
  }
  if (!fs::is_directory(path, error))
    throw std::runtime_error(path + ": is there already, and no folder");
  if (!fs::is_empty(path, error) || error)
    throw std::runtime_error(path + ": is a folder with files in it: name a new one");
  if (fs::equivalent(path, fs::current_path(error), error))
    throw std::runtime_error(path + ": is the current folder: name a new one");
  return fs::canonical(path, error).string();
}

/// Whoever holds the lock still writes; the system frees that of who was killed.
bool
lock(int descriptor)
{
  return descriptor >= 0 && ::flock(descriptor, LOCK_EX | LOCK_NB) == 0;
}

/// With its files, but with no folder in it: that is not ours.
void
removeFolder(const std::string& path) noexcept
{
  std::error_code error;
  for (fs::directory_iterator entry(path, error), end; !error && entry != end;
       entry.increment(error))
    ::unlink(entry->path().c_str());
  ::rmdir(path.c_str());
}

int
openFolder(const std::string& path)
{
  return ::open(path.c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
}

} // namespace

class AtomicFolder::Impl {
public:
  explicit Impl(std::string path) : path_(std::move(path)), target_(freePath(path_))
  {
    constexpr int kMostWriters = 16;
    for (int n = 0; n < kMostWriters; ++n) {
      temporary_ = io::temporaryName(target_, n);
      if (take())
        return;
    }
    io::failToWrite(path_, EEXIST);
  }

  ~Impl()
  {
    if (!temporary_.empty())
      removeFolder(temporary_);
    ::close(descriptor_);
  }

  const std::string& temporaryPath() const
  {
    return temporary_;
  }

  void commit()
  {
    ::fsync(descriptor_); // as far as the file system can
    // Replaces an empty folder, and nothing else.
    if (::rename(temporary_.c_str(), target_.c_str()) != 0)
      io::failToWrite(path_, errno);
    temporary_.clear();
  }

private:
  /// \return false when another writer has that name.
  bool take()
  {
    if (const int left = openFolder(temporary_); left >= 0) {
      if (lock(left))
        removeFolder(temporary_);
      ::close(left);
    }
    constexpr mode_t kAsUsual = 0777;
    if (::mkdir(temporary_.c_str(), kAsUsual) != 0) {
      if (errno == EEXIST)
        return false;
      io::failToWrite(path_, errno);
    }
    descriptor_ = openFolder(temporary_);
    if (descriptor_ < 0) {
      const int error = errno;
      ::rmdir(temporary_.c_str());
      io::failToWrite(path_, error);
    }
    lock(descriptor_); // where folders cannot be locked, none is taken for left over
    struct stat folder {};
    if (::fstat(descriptor_, &folder) == 0 && folder.st_nlink > 0)
      return true;
    ::close(std::exchange(descriptor_, -1)); // taken for left over before the lock
    return false;
  }

  std::string path_;
  std::string target_;
  std::string temporary_; ///< empty when it is no more
  int descriptor_ = -1;
};

AtomicFolder::AtomicFolder(std::string path)
: impl_(std::make_unique<Impl>(std::move(path)))
{}

AtomicFolder::~AtomicFolder() = default;

const std::string&
AtomicFolder::temporaryPath() const
{
  return impl_->temporaryPath();
}

void
AtomicFolder::commit()
{
  impl_->commit();
}

} // namespace holdfast
