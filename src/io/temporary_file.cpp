#include "temporary_file.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <charconv>
#include <climits>
#include <cstdint>
#include <cstring>
#include <mutex>
#include <stdexcept>
#include <system_error>

namespace holdfast::io {
namespace {

/// More writers of one file at a time than make sense.
constexpr int kMostWriters = 1000;

/// How many names are searched for what killed writers have left; they begin at 0.
constexpr int kSearched = 16;

[[noreturn]] void
fail(int error)
{
  throw std::system_error(error, std::generic_category());
}

/// The files to remove, for a signal handler: nothing here is allocated or locked while
/// it reads. Files beyond the capacity are left to the next writer of the same name.
class Registry {
public:
  /// \return the entry, or -1.
  int add(const std::string& path)
  {
    if (path.size() >= PATH_MAX)
      return -1;
    for (std::size_t i = 0; i < entries_.size(); ++i)
      if (!isUsed(entries_[i].version)) {
        std::memcpy(entries_[i].path, path.c_str(), path.size() + 1);
        ++entries_[i].version;
        return static_cast<int>(i);
      }
    return -1;
  }

  void remove(int entry)
  {
    if (entry >= 0)
      ++entries_[static_cast<std::size_t>(entry)].version;
  }

  bool has(const std::string& path) const
  {
    return std::any_of(entries_.begin(), entries_.end(), [&path](const Entry& entry) {
      return isUsed(entry.version) && path == entry.path;
    });
  }

  void unlinkAll() const noexcept
  {
    for (const Entry& entry : entries_) {
      const unsigned version = entry.version;
      char path[PATH_MAX];
      if (!isUsed(version))
        continue;
      std::memcpy(path, entry.path, sizeof(path));
      std::atomic_thread_fence(std::memory_order_acquire);
      if (entry.version == version) // nobody has exchanged it meanwhile
        ::unlink(path);
    }
  }

private:
  struct Entry {
    std::atomic<unsigned> version{0}; ///< odd: in use
    char path[PATH_MAX] = {};
  };

  static bool isUsed(unsigned version)
  {
    return version % 2 == 1;
  }

  std::array<Entry, 64> entries_;
};

static_assert(std::atomic<unsigned>::is_always_lock_free, "as signal handlers need it");

Registry registry;
std::mutex naming; // of add(), has(), and all between the choice of a name and its use

std::uint64_t
hashOf(const std::string& name) // FNV-1a
{
  std::uint64_t hash = 0xcbf29ce484222325;
  for (const char c : name)
    hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3;
  return hash;
}

/// At most `most` bytes, no half of a UTF-8 character, and different for different
/// names.
std::string
shortened(const std::string& name, std::size_t most)
{
  if (name.size() <= most)
    return name;
  std::array<char, 16> digits{};
  const auto end =
      std::to_chars(digits.data(), digits.data() + digits.size(), hashOf(name), 16);
  const std::string hash(digits.data(), end.ptr);
  std::size_t kept = most > hash.size() ? most - hash.size() - 1 : 0;
  while (kept > 0 && (static_cast<unsigned char>(name[kept]) & 0xC0U) == 0x80U)
    --kept;
  return name.substr(0, kept) + "-" + hash;
}

/// Up to and with the last slash; empty where there is none.
std::string
folderOf(const std::string& path)
{
  return path.substr(0, path.find_last_of('/') + 1);
}

std::string
orHere(const std::string& folder)
{
  return folder.empty() ? "." : folder;
}

/// \return false when somebody else holds the file, or has removed it. Where files
/// cannot be locked, nothing is ever removed as left over.
bool
lock(int descriptor)
{
  if (::flock(descriptor, LOCK_EX | LOCK_NB) != 0)
    return errno != EWOULDBLOCK;
  struct stat file {};
  return ::fstat(descriptor, &file) != 0 || file.st_nlink > 0;
}

/// Whether the descriptor is a regular file, which still has that name.
bool
isFileAt(int descriptor, const std::string& path)
{
  struct stat opened {};
  struct stat named {};
  return ::fstat(descriptor, &opened) == 0 && ::lstat(path.c_str(), &named) == 0 &&
         S_ISREG(opened.st_mode) && opened.st_dev == named.st_dev &&
         opened.st_ino == named.st_ino;
}

/// Removes a temporary whose writer no longer runs: the system has freed its lock.
void
removeLeftover(const std::string& path)
{
  if (registry.has(path))
    return;
  const int descriptor =
      ::open(path.c_str(), O_RDWR | O_NOFOLLOW | O_NONBLOCK | O_NOCTTY | O_CLOEXEC);
  if (descriptor < 0)
    return;
  if (::flock(descriptor, LOCK_EX | LOCK_NB) == 0 && isFileAt(descriptor, path))
    ::unlink(path.c_str());
  ::close(descriptor);
}

/// The permissions of a file that is about to be replaced, and its owner if we may.
void
copyOwnership(const std::string& target, int descriptor)
{
  struct stat old {};
  struct stat now {};
  if (::stat(target.c_str(), &old) != 0 || ::fstat(descriptor, &now) != 0)
    return;
  if (old.st_uid != now.st_uid || old.st_gid != now.st_gid)
    if (::fchown(descriptor, old.st_uid, old.st_gid) != 0)
      old.st_mode &= ~static_cast<mode_t>(S_ISUID | S_ISGID);
  ::fchmod(descriptor, old.st_mode & 07777U);
}

} // namespace

std::string
temporaryName(const std::string& target, int n)
{
  const std::string folder = folderOf(target);
  const std::string suffix = ".holdfast-partial-" + std::to_string(n);
  const long limit = ::pathconf(orHere(folder).c_str(), _PC_NAME_MAX);
  const auto most = static_cast<std::size_t>(limit > 0 ? limit : NAME_MAX);
  const std::size_t room = most > suffix.size() ? most - suffix.size() : 0;
  return folder + shortened(target.substr(folder.size()), room) + suffix;
}

TemporaryFile::TemporaryFile(const std::string& target) : target_(target)
{
  const std::lock_guard<std::mutex> guard(naming);
  for (int n = 0; n < kSearched; ++n)
    removeLeftover(temporaryName(target_, n));
  create();
  entry_ = registry.add(path_);
}

void
TemporaryFile::create()
{
  // As private as what it replaces, from the start.
  struct stat old {};
  const mode_t mode = ::stat(target_.c_str(), &old) == 0 ? 0600 : 0666;
  for (int n = 0; n < kMostWriters; ++n) {
    path_ = temporaryName(target_, n);
    // Whatever has that name already, a link that leads elsewhere included, is refused.
    descriptor_ = ::open(path_.c_str(),
                         O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC,
                         mode);
    if (descriptor_ >= 0 && lock(descriptor_))
      return;
    if (descriptor_ >= 0)
      ::close(descriptor_); // taken for a leftover before it was locked
    else if (errno != EEXIST)
      fail(errno);
  }
  fail(EEXIST);
}

TemporaryFile::~TemporaryFile()
{
  if (!path_.empty())
    drop();
  ::close(descriptor_);
}

void
TemporaryFile::drop()
{
  registry.remove(entry_);
  ::unlink(path_.c_str());
  path_.clear();
}

void
TemporaryFile::secure()
{
  // Not every file system can promise anything.
  if (::fsync(descriptor_) != 0 && errno != EINVAL && errno != ENOTSUP &&
      errno != EROFS)
    fail(errno);
}

void
TemporaryFile::publish()
{
  if (path_.empty())
    return; // it was
  copyOwnership(target_, descriptor_);
  // Once it is renamed, its name may be another's.
  registry.remove(entry_);
  entry_ = -1;
  if (::rename(path_.c_str(), target_.c_str()) != 0)
    fail(errno);
  path_.clear();
  const int folder =
      ::open(orHere(folderOf(target_)).c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (folder < 0)
    return;
  ::fsync(folder); // the name, as far as the file system can
  ::close(folder);
}

void
failToWrite(const std::string& path, int error)
{
  throw std::runtime_error(
      path + ": cannot be written: " + std::generic_category().message(error));
}

void
removeAllTemporaries() noexcept
{
  registry.unlinkAll();
}

} // namespace holdfast::io
