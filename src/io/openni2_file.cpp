#include "openni2_file.h"

#include "openni2_runtime.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <utility>

namespace holdfast::io {

namespace {

// The format: a header, then records of a header, fields and, for frames, data;
// little-endian, packed.

enum RecordType : std::uint32_t {
  kNodeAdded_1_0_0_4 = 0x02,
  kIntProperty = 0x03,
  kGeneralProperty = 0x06,
  kNewData = 0x0A,
  kEnd = 0x0B,
  kNodeAdded_1_0_0_5 = 0x0C,
  kNodeAdded = 0x0D,
  kSeekTable = 0x0E,
};

constexpr std::uint32_t kRecordMagic = 0x0052494E; // "NIR"
constexpr std::uint32_t kDepthNode = 2;
constexpr std::uint32_t kColorNode = 3;
constexpr std::uint32_t kNone = 0xFFFFFFFF;

/// Codecs: their names, as numbers.
constexpr std::uint32_t kUncompressed = 0x454E4F4E; // "NONE"
constexpr std::uint32_t kSteps = 0x507A3631; // "16zP"
constexpr std::uint32_t kStepsInTable = 0x547A3631; // "16zT"

/// Pixel formats of OpenNI2.
constexpr std::uint32_t kNotSaid = 0;
constexpr std::uint32_t kDepthInMillimetres = 100;
constexpr std::uint32_t kDepthIn100Micrometres = 101;
constexpr std::uint32_t kRgb888 = 200;
constexpr std::uint32_t kRgb24OfOpenni1 = 1;

constexpr int kLargestSide = 4096;
constexpr std::uint32_t kLargestRecord = 1U << 26U;

[[noreturn]] void
damaged(const std::string& what)
{
  throw Openni2Error("the recording is damaged: " + what);
}

/// Takes values from the fields of a record, one after the other.
class Fields {
public:
  explicit Fields(const std::vector<char>& bytes) : bytes_(bytes) {}

  template <typename T>
  T get()
  {
    T value;
    std::memcpy(&value, take(sizeof(T)), sizeof(T));
    return value;
  }

  /// A length and that many characters, the last of them 0.
  std::string getName()
  {
    const auto size = get<std::uint32_t>();
    const char* text = take(size);
    if (size == 0 || text[size - 1] != '\0')
      damaged("a name has no end");
    return text;
  }

private:
  const char* take(std::size_t size)
  {
    if (size > bytes_.size() - used_)
      damaged("a record is too short");
    used_ += size;
    return bytes_.data() + used_ - size;
  }

  const std::vector<char>& bytes_;
  std::size_t used_ = 0;
};

void
checkDepth(const OniStream& depth)
{
  const auto is_plausible = [](int side) { return side > 1 && side <= kLargestSide; };
  if (!is_plausible(depth.width) || !is_plausible(depth.height) ||
      depth.frames_per_second < 1)
    damaged("the size of its images makes no sense");
  if (depth.is_cropped)
    throw Openni2Error("the images are cropped: that is not supported");
  if (depth.codec != kUncompressed && depth.codec != kSteps &&
      depth.codec != kStepsInTable)
    throw Openni2Error("the depth is compressed in a way that we do not know");
  if (depth.pixel_format != kNotSaid && depth.pixel_format != kDepthInMillimetres &&
      depth.pixel_format != kDepthIn100Micrometres)
    throw Openni2Error("the depth is of a format that we do not know");
}

bool
isUsableColor(const OniStream& color, const OniStream& depth)
{
  return color.codec == kUncompressed && color.pixel_format == kRgb888 &&
         !color.is_cropped && color.width == depth.width &&
         color.height == depth.height;
}

struct Record {
  std::uint32_t type = 0;
  std::uint32_t node = 0;
  std::vector<char> fields;
  std::uint64_t data_position = 0;
  std::uint32_t data_bytes = 0;
};

class Reader {
public:
  explicit Reader(const std::string& path)
  : in_(path, std::ios::binary), size_(std::filesystem::file_size(path))
  {}

  OniFile read();

private:
  template <typename T>
  T get()
  {
    T value;
    if (!in_.read(reinterpret_cast<char*>(&value), sizeof(T)))
      throw Openni2Error("is cut off in its header");
    return value;
  }

  void readHeader();
  bool nextRecord();
  void visit();
  void addNode();
  void setProperty();
  void addFrame();
  void countFrames();

  std::ifstream in_;
  const std::uint64_t size_;
  std::uint64_t header_bytes_ = 0; ///< of a record
  Record record_;
  std::map<std::uint32_t, OniStream> nodes_;
  std::uint32_t depth_node_ = kNone;
  std::uint32_t color_node_ = kNone;
  OniFile file_;
  std::map<std::uint32_t, std::uint32_t> frames_of_; ///< number by node
  bool lacks_frames_ = false;
  bool at_end_ = false;
};

void
Reader::readHeader()
{
  if (!in_)
    throw Openni2Error("cannot be opened");
  if (size_ == 0)
    throw Openni2Error("is empty");
  if (get<std::array<char, 4>>() != std::array<char, 4>{'N', 'I', '1', '0'})
    throw Openni2Error("is no .oni recording");
  const auto major = get<std::uint8_t>();
  const auto minor = get<std::uint8_t>();
  const auto maintenance = get<std::uint16_t>();
  if (major != 1 || minor != 0 || maintenance > 1)
    throw Openni2Error("is of a version of .oni that we do not know");
  get<std::uint32_t>(); // build
  get<std::uint64_t>(); // last time stamp
  get<std::uint32_t>(); // number of streams
  // Positions within the file got 64 bits in version 1.0.1.
  header_bytes_ = maintenance == 1 ? 28 : 24;
}

/// \return false when the file ends before the record does.
bool
Reader::nextRecord()
{
  const auto position = static_cast<std::uint64_t>(in_.tellg());
  if (position + header_bytes_ > size_)
    return false;
  if (get<std::uint32_t>() != kRecordMagic)
    damaged("no record begins at byte " + std::to_string(position));
  record_.type = get<std::uint32_t>();
  record_.node = get<std::uint32_t>();
  const auto bytes = get<std::uint32_t>();
  record_.data_bytes = get<std::uint32_t>();
  if (record_.type < kNodeAdded_1_0_0_4 || record_.type > kSeekTable ||
      bytes < header_bytes_ || bytes > kLargestRecord ||
      record_.data_bytes > kLargestRecord)
    damaged("the record at byte " + std::to_string(position) + " makes no sense");
  record_.data_position = position + bytes;
  const std::uint64_t end = record_.data_position + record_.data_bytes;
  if (end > size_)
    return false;
  record_.fields.resize(bytes - header_bytes_);
  in_.seekg(static_cast<std::streamoff>(position + header_bytes_));
  in_.read(record_.fields.data(), static_cast<std::streamsize>(record_.fields.size()));
  in_.seekg(static_cast<std::streamoff>(end));
  return true;
}

void
Reader::visit()
{
  switch (record_.type) {
  case kNodeAdded_1_0_0_4:
  case kNodeAdded_1_0_0_5:
  case kNodeAdded:
    return addNode();
  case kIntProperty:
  case kGeneralProperty:
    return setProperty();
  case kNewData:
    return addFrame();
  case kSeekTable:
    return countFrames();
  case kEnd:
    at_end_ = true;
    file_.is_closed = !lacks_frames_;
  }
}

void
Reader::addNode()
{
  Fields fields(record_.fields);
  fields.getName();
  const auto type = fields.get<std::uint32_t>();
  nodes_[record_.node] = {};
  nodes_[record_.node].codec = fields.get<std::uint32_t>();
  if (type == kDepthNode)
    depth_node_ = record_.node;
  else if (type == kColorNode)
    color_node_ = record_.node;
}

void
Reader::setProperty()
{
  Fields fields(record_.fields);
  OniStream& stream = nodes_[record_.node];
  const std::string name = fields.getName();
  fields.get<std::uint32_t>(); // size
  if (name == "xnMapOutputMode") {
    stream.width = fields.get<std::int32_t>();
    stream.height = fields.get<std::int32_t>();
    stream.frames_per_second = fields.get<std::int32_t>();
  }
  else if (name == "oniPixelFormat")
    stream.pixel_format = static_cast<std::uint32_t>(fields.get<std::uint64_t>());
  else if (name == "xnPixelFormat" && stream.pixel_format == kNotSaid &&
           fields.get<std::uint64_t>() == kRgb24OfOpenni1)
    stream.pixel_format = kRgb888;
  else if (name == "xnFOV") {
    stream.horizontal_fov = fields.get<double>();
    stream.vertical_fov = fields.get<double>();
  }
  else if (name == "xnMirror")
    stream.is_mirrored = fields.get<std::uint64_t>() != 0;
  else if (name == "xnCropping")
    stream.is_cropped = fields.get<std::uint32_t>() != 0;
}

void
Reader::addFrame()
{
  ++frames_of_[record_.node];
  if (record_.node != depth_node_ && record_.node != color_node_)
    return;
  Fields fields(record_.fields);
  OniFrame frame;
  frame.is_depth = record_.node == depth_node_;
  frame.timestamp_us = fields.get<std::uint64_t>();
  frame.number = fields.get<std::int32_t>();
  frame.position = record_.data_position;
  frame.bytes = record_.data_bytes;
  file_.frames.push_back(frame);
}

/// The table has an entry for each frame, and one before them. On a full disk the
/// recorder of OpenNI2 goes on, and closes a file in which frames are missing.
void
Reader::countFrames()
{
  const std::uint64_t entry_bytes = header_bytes_ - 8;
  if (record_.data_bytes / entry_bytes > frames_of_[record_.node] + 1)
    lacks_frames_ = true;
}

OniFile
Reader::read()
{
  readHeader();
  while (!at_end_ && nextRecord())
    visit();
  auto& frames = file_.frames;
  if (std::none_of(frames.begin(), frames.end(), std::mem_fn(&OniFrame::is_depth)))
    throw Openni2Error("the recording holds no depth image");
  file_.depth = nodes_[depth_node_];
  checkDepth(file_.depth);
  if (file_.depth.pixel_format == kDepthIn100Micrometres)
    file_.depth.metres_per_unit = 1e-4;
  if (color_node_ != kNone && isUsableColor(nodes_[color_node_], file_.depth))
    file_.color = nodes_[color_node_];
  else
    frames.erase(std::remove_if(frames.begin(),
                                frames.end(),
                                std::not_fn(std::mem_fn(&OniFrame::is_depth))),
                 frames.end());
  return std::move(file_);
}

std::size_t
pixelsOf(const OniStream& stream)
{
  return static_cast<std::size_t>(stream.width) *
         static_cast<std::size_t>(stream.height);
}

/// Depths as differences between neighbours, or between their places in a table. Each
/// byte holds two steps; 15 in place of the second, or a byte 0xFF, says that a larger
/// one follows; 0xE0 + n, that n pairs of pixels equal the last; 13, that there is no
/// second one.
class StepDecoder {
public:
  StepDecoder(const std::vector<std::uint8_t>& code, bool has_table, std::size_t pixels)
  : code_(code), pixels_(pixels)
  {
    image_.reserve(pixels);
    if (has_table)
      table_.resize(takeNumber());
    for (std::uint16_t& depth : table_)
      depth = takeNumber();
  }

  std::vector<std::uint16_t> decode()
  {
    last_ = takeNumber();
    repeat(1);
    while (next_ < code_.size())
      decodeByte(take());
    if (image_.size() != pixels_)
      damaged("pixels are missing");
    return std::move(image_);
  }

private:
  void decodeByte(int byte)
  {
    const int second = byte & 0xF;
    if (byte == 0xFF)
      return largeStep();
    if (byte >= 0xE0)
      return repeat(2 * second);
    // The recorder of OpenNI2 writes the equal pixels that come before a single last
    // step behind it.
    if (second == 13 && next_ < code_.size())
      repeat(2 * (take() & 0xF));
    step(byte >> 4);
    if (second == 15)
      largeStep();
    else if (second != 13)
      step(second);
  }

  void step(int code)
  {
    last_ = static_cast<std::uint16_t>(last_ + 6 - code);
    repeat(1);
  }

  void largeStep()
  {
    const int byte = take();
    last_ = static_cast<std::uint16_t>(byte >= 128 ? last_ + 192 - byte :
                                                     byte * 256 + take());
    repeat(1);
  }

  void repeat(int times)
  {
    if (image_.size() + static_cast<std::size_t>(times) > pixels_)
      damaged("there are too many pixels");
    if (!table_.empty() && last_ >= table_.size())
      damaged("a depth is not in the table");
    image_.insert(image_.end(),
                  static_cast<std::size_t>(times),
                  table_.empty() ? last_ : table_[last_]);
  }

  int take()
  {
    if (next_ == code_.size())
      damaged("an image breaks off");
    return code_[next_++];
  }

  std::uint16_t takeNumber()
  {
    const int low = take();
    return static_cast<std::uint16_t>(low + 256 * take());
  }

  const std::vector<std::uint8_t>& code_;
  const std::size_t pixels_;
  std::vector<std::uint16_t> table_;
  std::vector<std::uint16_t> image_;
  std::size_t next_ = 0; ///< byte of the code
  std::uint16_t last_ = 0; ///< depth or place in the table
};

} // namespace

OniFile
readOniFile(const std::string& path)
{
  std::error_code error;
  if (!std::filesystem::exists(path, error))
    throw Openni2Error(path + ": no such file");
  if (!std::filesystem::is_regular_file(path, error))
    throw Openni2Error(path + ": is no regular file");
  try {
    return Reader(path).read();
  }
  catch (const Openni2Error& cause) {
    throw Openni2Error(path + ": " + cause.what());
  }
}

std::vector<std::uint16_t>
decodeDepth(const OniStream& stream, const std::vector<std::uint8_t>& data)
{
  const std::size_t pixels = pixelsOf(stream);
  if (stream.codec != kUncompressed)
    return StepDecoder(data, stream.codec == kStepsInTable, pixels).decode();
  if (data.size() != 2 * pixels)
    damaged("an image is not of the size it should be");
  std::vector<std::uint16_t> depths(pixels);
  std::memcpy(depths.data(), data.data(), data.size());
  return depths;
}

std::vector<std::uint8_t>
decodeColor(const OniStream& stream, const std::vector<std::uint8_t>& data)
{
  if (data.size() != 3 * pixelsOf(stream))
    damaged("an image is not of the size it should be");
  return data;
}

} // namespace holdfast::io
