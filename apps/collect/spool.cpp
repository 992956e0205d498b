#include "spool.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <utility>

namespace holdfast::app {
namespace {

/// What follows in the file. A source begins with its stamp and ends with End.
enum class Mark : std::uint32_t { Source = 0x31667268, Cloud, Patches, Failure, End };

/// The size of a row is part of it: another version's rows are no use.
constexpr std::uint64_t kRowBytes = sizeof(PatchRow);

} // namespace

/// Bytes with errors as exceptions.
struct Spool::Stream {
  explicit Stream(const std::string& file_path) : path(file_path)
  {
    const int descriptor = ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
    if (descriptor < 0)
      fail();
    if (::flock(descriptor, LOCK_EX | LOCK_NB) != 0) {
      ::close(descriptor);
      throw std::runtime_error(path + ": another process is at it");
    }
    file = ::fdopen(descriptor, "r+b");
    if (file == nullptr)
      fail();
  }

  ~Stream()
  {
    std::fclose(file);
  }

  Stream(const Stream&) = delete;
  Stream& operator=(const Stream&) = delete;

  [[noreturn]] void fail() const
  {
    throw std::runtime_error(path + ": " + std::strerror(errno));
  }

  void seek(std::uint64_t at)
  {
    if (::fseeko(file, static_cast<off_t>(at), SEEK_SET) != 0)
      fail();
  }

  std::uint64_t tell() const
  {
    return static_cast<std::uint64_t>(::ftello(file));
  }

  void truncate(std::uint64_t size)
  {
    if (std::fflush(file) != 0 ||
        ::ftruncate(::fileno(file), static_cast<off_t>(size)) != 0)
      fail();
    seek(size);
  }

  void writeBytes(const void* bytes, std::size_t size)
  {
    if (size > 0 && std::fwrite(bytes, 1, size, file) != size)
      fail();
  }

  template <typename T>
  void write(const T& value)
  {
    writeBytes(&value, sizeof value);
  }

  void write(const std::string& text)
  {
    write(static_cast<std::uint64_t>(text.size()));
    writeBytes(text.data(), text.size());
  }

  bool readBytes(void* bytes, std::size_t size)
  {
    return size == 0 || std::fread(bytes, 1, size, file) == size;
  }

  template <typename T>
  bool read(T& value)
  {
    return readBytes(&value, sizeof value);
  }

  /// \return false at the end, which may be in the middle of it.
  bool read(std::string& text)
  {
    std::uint64_t size = 0;
    if (!read(size) || size > (1ULL << 30))
      return false;
    text.resize(size);
    return readBytes(text.data(), size);
  }

  void write(const CloudRow& cloud)
  {
    for (const std::string* text :
         {&cloud.name, &cloud.path, &cloud.fingerprint, &cloud.settings})
      write(*text);
    write(cloud.position);
    write(cloud.orientation_wxyz);
    write(cloud.offset);
  }

  bool read(CloudRow& cloud)
  {
    for (std::string* text :
         {&cloud.name, &cloud.path, &cloud.fingerprint, &cloud.settings})
      if (!read(*text))
        return false;
    return read(cloud.position) && read(cloud.orientation_wxyz) && read(cloud.offset);
  }

  void write(const FailedCloud& failed)
  {
    for (const std::string* text :
         {&failed.name, &failed.path, &failed.fingerprint, &failed.reason})
      write(*text);
  }

  bool read(FailedCloud& failed)
  {
    for (std::string* text :
         {&failed.name, &failed.path, &failed.fingerprint, &failed.reason})
      if (!read(*text))
        return false;
    return true;
  }

  bool readPatches(std::vector<PatchRow>& rows)
  {
    std::uint64_t count = 0;
    if (!read(count) || count > (1ULL << 20))
      return false;
    rows.resize(count);
    return readBytes(rows.data(), count * kRowBytes);
  }

  std::string path;
  std::FILE* file = nullptr;
};

namespace {

/// Reads a source's records. \return false when they are not complete.
template <typename Stream>
bool
readRecords(Stream& stream, const ResultSink& sink)
{
  std::vector<PatchRow> rows;
  for (Mark mark{}; stream.read(mark);) {
    CloudRow cloud;
    FailedCloud failed;
    switch (mark) {
    case Mark::Cloud:
      if (!stream.read(cloud) || !stream.read(cloud.patches))
        return false;
      sink.cloud(cloud);
      break;
    case Mark::Patches:
      if (!stream.readPatches(rows))
        return false;
      sink.patches(rows.data(), rows.size());
      break;
    case Mark::Failure:
      if (!stream.read(failed))
        return false;
      sink.failure(failed);
      break;
    case Mark::End:
      return true;
    default:
      return false;
    }
  }
  return false;
}

/// \return true when the stream stands behind the start of a source with this stamp.
template <typename Stream>
bool
readStart(Stream& stream, std::uint64_t& stamp)
{
  Mark mark{};
  std::uint64_t row_bytes = 0;
  return stream.read(mark) && mark == Mark::Source && stream.read(row_bytes) &&
         row_bytes == kRowBytes && stream.read(stamp);
}

const ResultSink kNowhere{[](const CloudRow&) {},
                          [](const PatchRow*, std::size_t) {},
                          [](const FailedCloud&) {}};

} // namespace

Spool::Spool(std::string path, const std::vector<ResultSource>& sources)
: path_(std::move(path)), stream_(std::make_unique<Stream>(path_))
{
  std::uint64_t stamp = 0;
  while (complete_ < sources.size() && readStart(*stream_, stamp) &&
         stamp == sources[complete_].stamp && readRecords(*stream_, kNowhere)) {
    ++complete_;
    end_ = stream_->tell();
  }
  stream_->truncate(end_);
}

Spool::~Spool() = default;

void
Spool::add(const ResultSource& source)
{
  try {
    stream_->write(Mark::Source);
    stream_->write(kRowBytes);
    stream_->write(source.stamp);
    std::uint64_t count_at = 0, count = 0;
    readSource(source,
               {[&](const CloudRow& cloud) {
                  stream_->write(Mark::Cloud);
                  stream_->write(cloud);
                  count_at = stream_->tell();
                  stream_->write(count);
                },
                [&](const PatchRow* rows, std::size_t n) {
                  stream_->write(Mark::Patches);
                  stream_->write(static_cast<std::uint64_t>(n));
                  stream_->writeBytes(rows, n * kRowBytes);
                  count += n;
                },
                [&](const FailedCloud& failed) {
                  stream_->write(Mark::Failure);
                  stream_->write(failed);
                }});
    if (count_at > 0) {
      const std::uint64_t here = stream_->tell();
      stream_->seek(count_at);
      stream_->write(count);
      stream_->seek(here);
    }
    stream_->write(Mark::End);
    if (std::fflush(stream_->file) != 0)
      stream_->fail();
    end_ = stream_->tell();
    ++complete_;
  }
  catch (...) {
    stream_->truncate(end_);
    throw;
  }
}

void
Spool::skip(const ResultSource& source)
{
  stream_->write(Mark::Source);
  stream_->write(kRowBytes);
  stream_->write(source.stamp);
  stream_->write(Mark::End);
  end_ = stream_->tell();
  ++complete_;
}

void
Spool::replay(const ResultSink& sink)
{
  stream_->seek(0);
  std::uint64_t stamp = 0;
  for (std::size_t i = 0; i < complete_; ++i)
    if (!readStart(*stream_, stamp) || !readRecords(*stream_, sink))
      throw std::runtime_error(path_ + ": cannot be read again");
}

void
Spool::remove()
{
  ::unlink(path_.c_str());
}

} // namespace holdfast::app
