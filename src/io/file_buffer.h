/// \file A stream buffer over a file descriptor.
#pragma once

#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstddef>
#include <streambuf>

namespace holdfast::io {

/// Writes to a descriptor that somebody else has opened and will close. Unlike
/// std::filebuf it remembers why it failed, and survives imbue() after that.
class FileBuffer : public std::streambuf {
public:
  explicit FileBuffer(int descriptor) : descriptor_(descriptor)
  {
    setp(buffer_.data(), buffer_.data() + buffer_.size());
  }

  /// errno of the first write that failed; 0: none.
  int error() const
  {
    return error_;
  }

protected:
  int_type overflow(int_type c) override
  {
    if (sync() != 0)
      return traits_type::eof();
    if (!traits_type::eq_int_type(c, traits_type::eof()))
      sputc(traits_type::to_char_type(c));
    return traits_type::not_eof(c);
  }

  int sync() override
  {
    const char* next = pbase();
    while (error_ == 0 && next < pptr()) {
      const auto written =
          ::write(descriptor_, next, static_cast<std::size_t>(pptr() - next));
      if (written >= 0)
        next += written;
      else if (errno != EINTR)
        error_ = errno;
    }
    setp(buffer_.data(), buffer_.data() + buffer_.size());
    return error_ == 0 ? 0 : -1;
  }

private:
  int descriptor_;
  int error_ = 0;
  std::array<char, 1 << 16> buffer_;
};

} // namespace holdfast::io
