/// \file Recordings (.oni) of any bytes, and the images in them.
#include "fuzz.h"
#include "io/openni2_file.h"

#include <algorithm>

namespace {

using namespace holdfast;
using fuzz::require;

/// An image decodes to its pixels, or is damaged.
void
decode(const io::OniFile& file, const io::OniFrame& frame, const std::uint8_t* bytes)
{
  const std::vector<std::uint8_t> image(bytes, bytes + frame.bytes);
  const io::OniStream& depth = file.depth;
  const auto pixels =
      static_cast<std::size_t>(depth.width) * static_cast<std::size_t>(depth.height);
  try {
    if (frame.is_depth)
      require(io::decodeDepth(depth, image).size() == pixels,
              "a depth image has all its pixels");
    else
      require(io::decodeColor(*file.color, image).size() == 3 * pixels,
              "a colour image has all its pixels");
  }
  catch (const std::runtime_error& error) {
    fuzz::requireOneLine(error);
  }
}

} // namespace

int
LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
  static const fuzz::MemoryFile file;
  constexpr std::size_t kDecoded = 4; // images of one input; the rest is alike
  try {
    const io::OniFile oni = io::readOniFile(file.hold(data, size));
    require(oni.depth.width > 0 && oni.depth.height > 0, "depth images have a size");
    std::size_t depths = 0;
    for (std::size_t i = 0; i < oni.frames.size(); ++i) {
      const io::OniFrame& frame = oni.frames[i];
      depths += frame.is_depth;
      require(frame.is_depth || oni.color, "colour images have a stream");
      require(frame.position <= size && frame.bytes <= size - frame.position,
              "images lie within the file");
      if (i < kDecoded)
        decode(oni, frame, data + frame.position);
    }
    require(depths > 0, "a recording has a depth image");
  }
  catch (const std::runtime_error& error) {
    fuzz::requireOneLine(error);
  }
  return 0;
}
