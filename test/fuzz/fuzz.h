/// \file What fuzz targets share.
#pragma once

#include <sys/mman.h>
#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <stdexcept>
#include <string>

/// What every target defines: one input, of any bytes. Returns 0; aborts where a
/// promise is broken.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace holdfast::fuzz {

/// Ends the program with the broken promise, so that the input is kept.
inline void
require(bool kept, const char* promise)
{
  if (kept)
    return;
  std::fprintf(stderr, "broken: %s\n", promise);
  std::abort();
}

/// Errors about data are one line that says something.
inline void
requireOneLine(const std::runtime_error& error)
{
  const std::string line = error.what();
  require(!line.empty(), "an error has a message");
  require(line.find('\n') == std::string::npos, "a message is one line");
}

/// Bytes under the name of a file. In memory: nothing is left behind when the program
/// ends in the midst.
class MemoryFile {
public:
  MemoryFile() : descriptor_(memfd_create("input", MFD_CLOEXEC))
  {
    require(descriptor_ >= 0, "there is memory for a file");
  }
  ~MemoryFile()
  {
    close(descriptor_);
  }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;

  /// \return the path, good until the next call.
  std::string hold(const std::uint8_t* data, std::size_t size) const
  {
    require(ftruncate(descriptor_, 0) == 0, "the file can be emptied");
    for (std::size_t done = 0; done < size;) {
      const ssize_t n =
          pwrite(descriptor_, data + done, size - done, static_cast<off_t>(done));
      require(n > 0, "the file can be written");
      done += static_cast<std::size_t>(n);
    }
    return "/proc/self/fd/" + std::to_string(descriptor_);
  }

private:
  int descriptor_;
};

} // namespace holdfast::fuzz
