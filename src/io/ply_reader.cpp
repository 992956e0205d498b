/// PLY files, by a reader of our own, since pcl::PLYReader (1.13) reads properties of
/// type double and short as zeros and trusts every size in a header, and no other
/// reader is packaged.
///
/// What pcl::PLYReader reads and this one refuses, since it would be read wrongly:
/// - a vertex property x, y or z with a word that is not a number;
/// - text whose rows have more values than the header announces properties, and binary
///   data of 1000 rows or more that have more bytes than it announces;
/// - more vertices than LoadOptions::max_points.
#include "cloud_readers.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <map>

#include <fmt/format.h>

namespace holdfast::io {
namespace {

struct Property {
  std::string name;
  ScalarType type;
  std::optional<ScalarType> list_size; ///< of a list: the type of its length
};

struct Element {
  std::string name;
  std::uint64_t count = 0;
  std::vector<Property> properties;
};

struct Header {
  std::string format;
  std::vector<Element> elements;
  /// Size of the pixel grid, from num_cols and num_rows or the camera's viewport.
  std::uint64_t columns = 0;
  std::uint64_t rows = 0;
  int unknown_lines = 0;
  std::string first_unknown;

  bool isAscii() const
  {
    return format == "ascii";
  }
};

[[noreturn]] void
corrupt(const std::string& what)
{
  throw std::runtime_error("corrupt PLY header: " + what);
}

/// A type nobody knows has kind '?'; in text that does not matter.
ScalarType
scalarType(std::string_view name)
{
  static const std::map<std::string_view, ScalarType> kTypes{
      {"bool", {'U', 1}},     {"char", {'I', 1}},    {"int8", {'I', 1}},
      {"uchar", {'U', 1}},    {"uint8", {'U', 1}},   {"short", {'I', 2}},
      {"int16", {'I', 2}},    {"ushort", {'U', 2}},  {"uint16", {'U', 2}},
      {"int", {'I', 4}},      {"int32", {'I', 4}},   {"uint", {'U', 4}},
      {"uint32", {'U', 4}},   {"long", {'I', 8}},    {"int64", {'I', 8}},
      {"longlong", {'I', 8}}, {"ulong", {'U', 8}},   {"uint64", {'U', 8}},
      {"float", {'F', 4}},    {"float32", {'F', 4}}, {"ulonglong", {'U', 8}},
      {"double", {'F', 8}},   {"float64", {'F', 8}}};
  const auto type = kTypes.find(name);
  return type == kTypes.end() ? ScalarType{'?', 1} : type->second;
}

Property
parseProperty(const std::vector<std::string_view>& words)
{
  if (words.size() == 3)
    return {std::string(words[2]), scalarType(words[1]), std::nullopt};
  if (words.size() != 5 || words[1] != "list")
    corrupt("a property is neither a number nor a list");
  const ScalarType length = scalarType(words[2]);
  if (length.kind == 'F' || length.kind == '?')
    corrupt("a list has a length that is not an integer");
  return {std::string(words[4]), scalarType(words[3]), length};
}

/// "obj_info num_cols 640" and its like; writers put them into comments, too.
void
parseRemark(const std::vector<std::string_view>& words, Header& header)
{
  if (words.size() != 3)
    return;
  const std::uint64_t count = parseCount(words[2]).value_or(0);
  if (words[1] == "num_cols" || words[1] == "viewportx")
    header.columns = count;
  else if (words[1] == "num_rows" || words[1] == "viewporty")
    header.rows = count;
}

void
parseEntry(const std::vector<std::string_view>& words, Header& header)
{
  if (words[0] == "format" && words.size() >= 2) {
    header.format = words[1];
  }
  else if (words[0] == "element") {
    const auto count = words.size() == 3 ? parseCount(words[2]) : std::nullopt;
    if (!count)
      corrupt("an element without a count");
    header.elements.push_back({std::string(words[1]), *count, {}});
  }
  else if (words[0] == "property") {
    if (header.elements.empty())
      corrupt("a property of no element");
    header.elements.back().properties.push_back(parseProperty(words));
  }
  else if (words[0] == "comment" || words[0] == "obj_info") {
    parseRemark(words, header);
  }
  else if (header.unknown_lines++ == 0) {
    header.first_unknown = printable(words[0]);
  }
}

void
checkHeader(const Header& header)
{
  if (!header.isAscii() && header.format != "binary_little_endian" &&
      header.format != "binary_big_endian")
    corrupt("no format ascii, binary_little_endian or binary_big_endian 1.0");
  if (header.isAscii())
    return;
  for (const Element& element : header.elements)
    for (const Property& property : element.properties)
      if (property.type.kind == '?')
        corrupt("property '" + printable(property.name) + "' has an unknown type");
}

/// `bytes` is left at the data.
Header
parseHeader(std::string_view& bytes)
{
  Header header;
  bytes = skipToText(bytes);
  const char line_end = lineEnd(bytes);
  if (splitWords(takeLine(bytes, line_end).value_or("")) !=
      std::vector<std::string_view>{"ply"})
    corrupt("the first line is not 'ply'");
  while (const auto line = takeLine(bytes, line_end)) {
    const auto words = splitWords(*line);
    if (words.empty())
      continue;
    if (words[0] != "end_header") {
      parseEntry(words, header);
      continue;
    }
    checkHeader(header);
    return header;
  }
  throw std::runtime_error("truncated or corrupt PLY header: no end_header");
}

/// The numbers of the data, one after the other.
class NumberSource {
public:
  NumberSource(std::string_view data, const std::string& format)
  : data_(data), ascii_(format == "ascii"), swap_(format == "binary_big_endian")
  {}

  double next(const ScalarType& type)
  {
    if (!ascii_)
      return type.read(take(static_cast<std::size_t>(type.size)), swap_);
    const auto value = parseNumber(nextWord());
    if (!value)
      throw std::runtime_error("corrupt: a value is not a number");
    return *value;
  }

  /// The next value, which nobody uses: it need not be a number.
  void skipValue(const ScalarType& type)
  {
    if (ascii_)
      nextWord();
    else
      take(static_cast<std::size_t>(type.size));
  }

  std::uint64_t nextLength(const Property& list)
  {
    const double length = next(*list.list_size);
    // Ends with the data at the latest.
    if (!(length >= 0.0) || length > static_cast<double>(data_.size()))
      throw std::runtime_error("truncated or corrupt: a list of impossible length");
    return static_cast<std::uint64_t>(length);
  }

  void skip(const Property& property)
  {
    if (!property.list_size) {
      skipValue(property.type);
      return;
    }
    const std::uint64_t length = nextLength(property);
    for (std::uint64_t i = 0; i < length; ++i)
      skipValue(property.type);
  }

  /// To be called behind every row: text may have more values in its line.
  void endRow()
  {
    if (!ascii_)
      return;
    const std::size_t next = data_.find_first_not_of(" \t\v\f");
    if (next != std::string_view::npos && data_[next] != '\n' && data_[next] != '\r')
      ends_within_line_ = true;
  }

  /// True when a row ended where its line had more values.
  bool endsWithinLine() const
  {
    return ends_within_line_;
  }

  std::size_t remaining() const
  {
    return data_.size();
  }

  /// Nothing but blanks, or the zeros some writers pad with.
  bool isAtEnd() const
  {
    constexpr std::string_view kPadding("\0 \t\r\n", 5);
    return data_.find_first_not_of(kPadding) == std::string_view::npos;
  }

  /// Fewest bytes a row of this element can take.
  std::size_t leastRowBytes(const Element& element) const
  {
    std::size_t bytes = 0;
    for (const Property& property : element.properties)
      bytes +=
          ascii_ ?
              1U :
              static_cast<std::size_t>(property.list_size.value_or(property.type).size);
    return bytes;
  }

private:
  std::string_view nextWord()
  {
    const std::string_view word = takeWord(data_);
    if (word.empty())
      throw std::runtime_error("truncated: data end early");
    return word;
  }

  const char* take(std::size_t n)
  {
    if (data_.size() < n)
      throw std::runtime_error("truncated: data end early");
    const char* bytes = data_.data();
    data_.remove_prefix(n);
    return bytes;
  }

  std::string_view data_;
  bool ascii_;
  bool swap_;
  bool ends_within_line_ = false;
};

bool
isNamed(const Property& property, std::string_view name, bool any_case)
{
  if (property.list_size || property.name.size() != name.size())
    return false;
  for (std::size_t i = 0; i < name.size(); ++i) {
    const char c = property.name[i];
    if (c != name[i] &&
        !(any_case && std::tolower(static_cast<unsigned char>(c)) == name[i]))
      return false;
  }
  return true;
}

/// Which properties of an element to keep: the index of each name, -1 where missing. A
/// name in capitals counts when there is none in small letters.
template <std::size_t N>
std::array<int, N>
indicesOf(const Element& element, const std::array<std::string_view, N>& names)
{
  std::array<int, N> indices;
  indices.fill(-1);
  for (std::size_t k = 0; k < N; ++k)
    for (const bool any_case : {false, true})
      for (std::size_t j = 0; j < element.properties.size() && indices[k] < 0; ++j)
        if (isNamed(element.properties[j], names[k], any_case))
          indices[k] = static_cast<int>(j);
  return indices;
}

/// Reads one row; `values[k]` is the property `names[k]`.
template <std::size_t N>
std::array<double, N>
readRow(NumberSource& source, const Element& element, const std::array<int, N>& wanted)
{
  std::array<double, N> values{};
  for (std::size_t j = 0; j < element.properties.size(); ++j) {
    const auto slot = std::find(wanted.begin(), wanted.end(), static_cast<int>(j));
    if (slot == wanted.end())
      source.skip(element.properties[j]);
    else
      values[static_cast<std::size_t>(slot - wanted.begin())] =
          source.next(element.properties[j].type);
  }
  source.endRow();
  return values;
}

/// What is read, and what the grid is made from when all is read.
struct Reading {
  explicit Reading(const LoadOptions& load) : options(load)
  {
    cloud.info.unit_m = load.unit_m;
  }

  const LoadOptions& options;
  RawCloud cloud;
  std::uint64_t columns = 0;
  std::uint64_t rows = 0;
  std::vector<std::int64_t> grid; ///< of range_grid: the vertex of each cell, or -1
};

/// The second three of the properties are there, of one byte each.
bool
hasColors(const Element& element, const std::array<int, 6>& wanted)
{
  return std::all_of(wanted.begin() + 3, wanted.end(), [&element](int index) {
    return index >= 0 &&
           element.properties[static_cast<std::size_t>(index)].type.kind == 'U' &&
           element.properties[static_cast<std::size_t>(index)].type.size == 1;
  });
}

/// Text may hold anything.
std::uint8_t
channel(double value)
{
  return value >= 0.0 && value <= 255.0 ? static_cast<std::uint8_t>(value) : 0;
}

void
readVertices(NumberSource& source, const Element& element, Reading& reading)
{
  auto wanted = indicesOf<6>(element, {"x", "y", "z", "red", "green", "blue"});
  if (std::find(wanted.begin(), wanted.begin() + 3, -1) != wanted.begin() + 3)
    throw std::runtime_error("has no properties x, y and z");
  if (element.count > 0x7fffffffU)
    corrupt("an impossible number of vertices");
  RawCloud& cloud = reading.cloud;
  if (!cloud.points->empty())
    corrupt("two elements vertex");
  checkPointCount(element.count, reading.options.max_points);
  const bool colored = reading.options.colors && hasColors(element, wanted);
  if (!colored)
    std::fill(wanted.begin() + 3, wanted.end(), -1); // need not be numbers
  std::vector<double> xyz;
  xyz.reserve(3 * element.count);
  cloud.info.colors.reserve(colored ? element.count : 0);
  for (std::uint64_t i = 0; i < element.count; ++i) {
    const auto row = readRow(source, element, wanted);
    for (std::size_t k = 0; k < 3; ++k)
      xyz.push_back(reading.options.unit_m * row[k]);
    if (colored)
      cloud.info.colors.push_back({channel(row[3]), channel(row[4]), channel(row[5])});
  }
  cloud.points->resize(element.count);
  placePoints(xyz, cloud);
  for (const Property& property : element.properties)
    cloud.info.fields.push_back(property.name);
}

/// Each cell of the grid holds one vertex or none.
void
readRangeGrid(NumberSource& source, const Element& element, Reading& reading)
{
  checkPointCount(element.count, reading.options.max_points);
  reading.grid.reserve(element.count);
  for (std::uint64_t cell = 0; cell < element.count; ++cell) {
    std::int64_t vertex = -1;
    for (const Property& property : element.properties) {
      if (property.name != "vertex_indices" || !property.list_size) {
        source.skip(property);
        continue;
      }
      const std::uint64_t length = source.nextLength(property);
      for (std::uint64_t i = 0; i < length; ++i) {
        const double index = source.next(property.type);
        vertex = index >= 0.0 && index < 2147483647.0 ?
                     static_cast<std::int64_t>(index) :
                     std::int64_t{2147483647};
      }
    }
    source.endRow();
    reading.grid.push_back(vertex);
  }
}

/// The sensor pose as PCL writes it: the axes are the rows of the rotation matrix.
void
readCamera(NumberSource& source, const Element& element, Reading& reading)
{
  const auto wanted = indicesOf<14>(element,
                                    {"view_px",
                                     "view_py",
                                     "view_pz",
                                     "x_axisx",
                                     "x_axisy",
                                     "x_axisz",
                                     "y_axisx",
                                     "y_axisy",
                                     "y_axisz",
                                     "z_axisx",
                                     "z_axisy",
                                     "z_axisz",
                                     "viewportx",
                                     "viewporty"});
  const auto v = readRow(source, element, wanted);
  const auto isSize = [](double size) { return size >= 1.0 && size < 65536.0; };
  if (isSize(v[12]) && isSize(v[13])) {
    reading.columns = static_cast<std::uint64_t>(v[12]);
    reading.rows = static_cast<std::uint64_t>(v[13]);
  }
  CloudFileInfo& info = reading.cloud.info;
  Pose pose;
  pose.c << v[0], v[1], v[2];
  pose.c *= reading.options.unit_m;
  pose.R << v[3], v[4], v[5], v[6], v[7], v[8], v[9], v[10], v[11];
  // Written with about six digits.
  const bool is_rotation =
      (pose.R * pose.R.transpose()).isIdentity(1e-3) && pose.R.determinant() > 0.0;
  if (pose.c.allFinite() && is_rotation)
    info.viewpoint = pose;
  else
    info.notices.emplace_back("the camera is not a pose; taken as not given");
}

void
readElement(NumberSource& source, const Element& element, Reading& reading)
{
  const auto least = product(element.count, source.leastRowBytes(element));
  if (!least || *least > source.remaining())
    throw std::runtime_error(fmt::format("truncated: too short for {} x {}",
                                         element.count,
                                         printable(element.name)));
  if (element.properties.empty() || element.count == 0)
    return;
  if (element.name == "vertex")
    return readVertices(source, element, reading);
  if (element.name == "range_grid")
    return readRangeGrid(source, element, reading);
  std::uint64_t row = 0;
  if (element.name == "camera") {
    readCamera(source, element, reading);
    ++row;
  }
  for (; row < element.count; ++row) {
    for (const Property& property : element.properties)
      source.skip(property);
    source.endRow();
  }
}

/// Moves the vertices into the cells that name them; other cells are invalid.
void
fillGrid(const std::vector<std::int64_t>& grid, RawCloud& cloud)
{
  const pcl::PointCloud<pcl::PointXYZ> vertices = *cloud.points;
  const float nan = std::numeric_limits<float>::quiet_NaN();
  std::vector<bool> is_used(vertices.size(), false);
  cloud.points->assign(grid.size(), pcl::PointXYZ(nan, nan, nan));
  auto& colors = cloud.info.colors;
  const auto vertex_colors = colors;
  colors.assign(vertex_colors.empty() ? 0 : grid.size(), {});
  for (std::size_t cell = 0; cell < grid.size(); ++cell) {
    if (grid[cell] < 0)
      continue;
    const auto vertex = static_cast<std::size_t>(grid[cell]);
    if (vertex >= vertices.size())
      throw std::runtime_error("corrupt: range_grid names a vertex that is not there");
    (*cloud.points)[cell] = vertices[vertex];
    if (!colors.empty())
      colors[cell] = vertex_colors[vertex];
    is_used[vertex] = true;
  }
  const auto lost = std::count(is_used.begin(), is_used.end(), false);
  if (lost > 0)
    cloud.info.notices.push_back(
        fmt::format("vertices in no cell of range_grid, left out: {}", lost));
}

/// Organizes the points when the file says how.
void
makeGrid(Reading& reading)
{
  RawCloud& cloud = reading.cloud;
  if (reading.columns <= 1 || reading.rows <= 1)
    return; // every file says 1 for a cloud without a grid
  const std::uint64_t cells =
      reading.grid.empty() ? cloud.points->size() : reading.grid.size();
  if (product(reading.columns, reading.rows) != cells) {
    cloud.info.notices.push_back(
        fmt::format("a grid of {} x {} is announced but has {} cells: not organized",
                    reading.columns,
                    reading.rows,
                    cells));
    return;
  }
  if (!reading.grid.empty())
    fillGrid(reading.grid, cloud);
  cloud.points->width = static_cast<std::uint32_t>(reading.columns);
  cloud.points->height = static_cast<std::uint32_t>(reading.rows);
}

/// More data than announced are left alone, unless they show that rows were misread.
void
judgeSurplus(const NumberSource& source, const Header& header, RawCloud& cloud)
{
  if (source.isAtEnd())
    return;
  if (source.endsWithinLine())
    throw std::runtime_error(
        "corrupt: rows have more values than the header announces properties");
  // In a small cloud that may be chance.
  const std::uint64_t rows = header.elements.back().count;
  if (!header.isAscii() && rows >= 1000 && source.remaining() % rows == 0)
    throw std::runtime_error(
        fmt::format("corrupt: {} bytes of data more per {} than the header announces",
                    source.remaining() / rows,
                    printable(header.elements.back().name)));
  cloud.info.notices.push_back(
      fmt::format("{} bytes behind the data announced: not used", source.remaining()));
}

} // namespace

RawCloud
readPly(std::string_view bytes, const LoadOptions& options)
{
  const Header header = parseHeader(bytes);
  NumberSource source(bytes, header.format);
  Reading reading(options);
  reading.columns = header.columns;
  reading.rows = header.rows;
  if (header.unknown_lines > 0)
    reading.cloud.info.notices.push_back(
        fmt::format("{} unknown header line{} ignored, the first: '{}'",
                    header.unknown_lines,
                    header.unknown_lines > 1 ? "s" : "",
                    header.first_unknown));
  for (const Element& element : header.elements)
    readElement(source, element, reading);
  RawCloud& cloud = reading.cloud;
  if (cloud.points->empty())
    throw std::runtime_error("holds no vertices");
  judgeSurplus(source, header, cloud);
  makeGrid(reading);
  cloud.info.format = "PLY " + header.format;
  return std::move(cloud);
}

} // namespace holdfast::io
