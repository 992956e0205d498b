#include "file_buffer.h"
#include "temporary_file.h"

#include <holdfast/io/atomic_file.h>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>
#include <locale>
#include <optional>
#include <ostream>
#include <stdexcept>
#include <system_error>
#include <utility>

namespace holdfast {
namespace {

/// Where a path leads when all links are followed, also if nothing is there.
std::string
followLinks(const std::string& path)
{
  namespace fs = std::filesystem;
  constexpr int kMostLinks = 40; // as the system allows
  fs::path target = path;
  std::error_code error;
  for (int i = 0; i < kMostLinks && fs::is_symlink(target, error); ++i) {
    const fs::path next = fs::read_symlink(target, error);
    if (error)
      io::failToWrite(path, error.value());
    target = target.parent_path() / next; // which is `next` if that is absolute
  }
  if (fs::is_symlink(target, error))
    io::failToWrite(path, ELOOP);
  return target.string();
}

/// A device or pipe is written directly: rename() would replace it by a file.
bool
isWrittenDirectly(const std::string& path)
{
  struct stat file {};
  if (::stat(path.c_str(), &file) != 0)
    return false;
  if (S_ISDIR(file.st_mode))
    throw std::runtime_error(path + ": cannot be written: it is a directory");
  return !S_ISREG(file.st_mode);
}

} // namespace

class AtomicFile::Impl {
public:
  explicit Impl(std::string path) : path_(std::move(path))
  {
    open();
    buffer_.emplace(temporary_ ? temporary_->descriptor() : device_);
    stream_.rdbuf(&*buffer_);
    stream_.imbue(std::locale::classic());
  }

  ~Impl()
  {
    if (!temporary_ && device_ >= 0)
      ::close(device_);
  }

  std::ostream& stream()
  {
    return stream_;
  }

  /// Everything is on the disk.
  void complete()
  {
    stream_.flush();
    if (!stream_)
      io::failToWrite(path_, buffer_->error() != 0 ? buffer_->error() : EIO);
    attempt([this] {
      if (temporary_)
        temporary_->secure();
    });
  }

  void publish()
  {
    attempt([this] {
      if (temporary_)
        temporary_->publish();
    });
  }

private:
  void open()
  {
    if (isWrittenDirectly(path_)) {
      device_ = ::open(path_.c_str(), O_WRONLY | O_CLOEXEC | O_NOCTTY);
      if (device_ < 0)
        io::failToWrite(path_, errno);
      return;
    }
    if (path_.empty() || path_.back() == '/')
      io::failToWrite(path_, path_.empty() ? ENOENT : EISDIR);
    const std::string target = followLinks(path_);
    attempt([&] { temporary_.emplace(target); });
  }

  template <typename Step>
  void attempt(const Step& step) const
  {
    try {
      step();
    }
    catch (const std::system_error& error) {
      io::failToWrite(path_, error.code().value());
    }
  }

  std::string path_;
  std::optional<io::TemporaryFile> temporary_; ///< nothing for a device
  int device_ = -1;
  std::optional<io::FileBuffer> buffer_;
  std::ostream stream_{nullptr};
};

AtomicFile::AtomicFile(std::string path)
: impl_(std::make_unique<Impl>(std::move(path)))
{}

AtomicFile::~AtomicFile() = default;

std::ostream&
AtomicFile::stream()
{
  return impl_->stream();
}

void
AtomicFile::commit()
{
  commit(std::vector<AtomicFile*>{this});
}

void
AtomicFile::commit(const std::vector<AtomicFile*>& files)
{
  for (AtomicFile* file : files)
    file->impl_->complete();
  for (AtomicFile* file : files)
    file->impl_->publish();
}

void
removeTemporaryFiles() noexcept
{
  io::removeAllTemporaries();
}

} // namespace holdfast
