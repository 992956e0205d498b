#include <holdfast/io/atomic_file.h>

#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <stdexcept>
#include <utility>

namespace holdfast {
namespace {

[[noreturn]] void
fail(const std::string& path, const std::string& what, int error)
{
  throw std::runtime_error(path + ": " + what + ": " + std::strerror(error));
}

} // namespace

AtomicFile::AtomicFile(std::string path) : path_(std::move(path)), target_(path_)
{
  std::error_code ignored;
  // A link stays a link; /dev/stdout is one.
  if (std::filesystem::is_symlink(path_, ignored))
    target_ = std::filesystem::weakly_canonical(path_, ignored).string();
  const auto kind = std::filesystem::status(path_, ignored).type();
  if (kind == std::filesystem::file_type::directory)
    throw std::runtime_error(path_ + ": cannot be written: it is a directory");
  // A device or pipe is written directly: rename() would replace it by a file.
  if (kind != std::filesystem::file_type::character &&
      kind != std::filesystem::file_type::fifo)
    temporary_ = target_ + ".partial-" + std::to_string(::getpid());
  errno = 0;
  stream_.open(temporary_.empty() ? target_ : temporary_,
               std::ios::binary | std::ios::trunc);
  if (!stream_)
    fail(path_, "cannot be written", errno);
}

AtomicFile::~AtomicFile()
{
  if (temporary_.empty())
    return;
  stream_.close();
  ::unlink(temporary_.c_str());
}

void
AtomicFile::commit()
{
  errno = 0;
  stream_.close();
  if (!stream_)
    fail(path_, "could not be written completely", errno != 0 ? errno : EIO);
  if (!temporary_.empty() && ::rename(temporary_.c_str(), target_.c_str()) != 0)
    fail(path_, "cannot be written", errno);
  temporary_.clear();
}

} // namespace holdfast
