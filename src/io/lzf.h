/// \file The LZF format, in which PCD files are compressed.
///
/// By code of our own: libpcl_io's would bring VTK into every process, and copies byte
/// by byte.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace holdfast::io {

/// A stream of runs: a byte below 32 stands before one more literal bytes than it says;
/// any other begins a copy of 3 to 264 bytes from up to 8192 bytes before.
std::string lzfCompress(std::string_view plain);

/// Unpacks a stream. Trusts nothing: no byte outside the two ranges is touched.
/// \return true when the stream is sound and fills exactly `size` bytes at `plain`.
bool lzfDecompress(std::string_view packed, char* plain, std::size_t size);

} // namespace holdfast::io
