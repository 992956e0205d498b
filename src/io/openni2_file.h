/// \file .oni recordings, read by ourselves: the player of OpenNI2 crashes or hangs on
/// damaged files, does not play what was cut off, decodes some depth images wrongly,
/// and now and then accesses what it has deleted when it is closed.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace holdfast::io {

struct OniStream {
  std::uint32_t codec = 0;
  int width = 0;
  int height = 0;
  int frames_per_second = 0;
  std::uint32_t pixel_format = 0; ///< OpenNI2's number; 0: not said
  double metres_per_unit = 1e-3; ///< of depths
  double horizontal_fov = 0.0; ///< rad; 0: not said
  double vertical_fov = 0.0;
  bool is_mirrored = false;
  bool is_cropped = false;
};

struct OniFrame {
  bool is_depth = false;
  int number = 0; ///< within its stream, from 1
  std::uint64_t timestamp_us = 0;
  std::uint64_t position = 0; ///< of its data in the file
  std::uint32_t bytes = 0;
};

struct OniFile {
  OniStream depth;
  std::optional<OniStream> color; ///< uncompressed and of the size of depth
  std::vector<OniFrame> frames; ///< of these two, in the order of the file
  /// False when it ends in the midst: its writer was killed, or writes on.
  bool is_closed = false;
};

/// Everything but the pixels. \throw pcl::IOException "PATH: cause" when the file is
/// missing, no recording, damaged, of a format that we do not know, or without a single
/// depth image.
OniFile readOniFile(const std::string& path);

/// The data of a frame as the recorder of OpenNI2 encodes depth, or no codec at all:
/// width * height numbers. \throw pcl::IOException when they are damaged.
std::vector<std::uint16_t> decodeDepth(const OniStream& stream,
                                       const std::vector<std::uint8_t>& data);

/// Red, green and blue of width * height pixels. \throw as above.
std::vector<std::uint8_t> decodeColor(const OniStream& stream,
                                      const std::vector<std::uint8_t>& data);

} // namespace holdfast::io
