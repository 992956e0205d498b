/// PCD files, by a reader of our own, since clouds come from anywhere and
/// pcl::PCDReader (1.13) trusts them: an empty file is a segmentation fault, a word
/// where a number belongs is read as 0, a compressed block that claims 2 GiB does not
/// end, a huge header is a bad_alloc, and coordinates in double precision come out as
/// zeros.
///
/// What pcl::PCDReader reads and this one refuses, since it would be read wrongly:
/// - a field x, y, z or covariance twice, or x, y or z with a COUNT other than 1;
/// - x, y, z or covariance with a word that is not a number;
/// - binary data of 1000 points or more whose size fits the number of points, but with
///   more bytes per point than the header announces: some field is missing or wider
///   there, or padded, as points are in memory;
/// - a compressed block of another size than the header announces;
/// - more points than LoadOptions::max_points.
#include "cloud_readers.h"
#include "lzf.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <memory>

#include <fmt/format.h>

namespace holdfast::io {
namespace {

struct Field {
  std::string name;
  ScalarType type;
  std::uint64_t count = 1;
  std::uint64_t offset = 0; ///< bytes from the start of a point
  std::uint64_t column = 0; ///< values from the start of a point

  std::uint64_t bytes() const
  {
    return count * static_cast<std::uint64_t>(type.size);
  }
};

struct Header {
  std::vector<Field> fields;
  std::uint64_t width = 0;
  std::uint64_t height = 1;
  std::uint64_t points = 0;
  std::uint64_t point_bytes = 0;
  std::uint64_t columns = 0;
  std::optional<Pose> viewpoint;
  std::string data;
  std::vector<std::string> notices;
};

[[noreturn]] void
corrupt(const std::string& what)
{
  throw std::runtime_error("corrupt PCD header: " + what);
}

std::string
lower(std::string_view word)
{
  std::string text(word);
  for (char& c : text)
    c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

/// The entries of the header, each split into words, up to and including DATA.
/// `bytes` is left at the data.
std::vector<std::vector<std::string_view>>
headerEntries(std::string_view& bytes)
{
  bytes = skipToText(bytes);
  const char line_end = lineEnd(bytes);
  std::vector<std::vector<std::string_view>> entries;
  while (const auto line = takeLine(bytes, line_end)) {
    auto words = splitWords(*line);
    if (words.empty() || words[0][0] == '#')
      continue;
    entries.push_back(std::move(words));
    if (entries.back()[0] == "DATA")
      return entries;
  }
  throw std::runtime_error("truncated or corrupt PCD header: no DATA line");
}

using Words = std::vector<std::string_view>;

const Words*
find(const std::vector<Words>& entries, std::string_view name)
{
  const auto entry = std::find_if(entries.begin(), entries.end(), [&](const Words& e) {
    return e[0] == name;
  });
  return entry == entries.end() ? nullptr : &*entry;
}

/// A count of the header, if it is there.
std::optional<std::uint64_t>
countEntry(const std::vector<Words>& entries, const std::string& name)
{
  const Words* entry = find(entries, name);
  if (entry == nullptr)
    return std::nullopt;
  const auto value = entry->size() == 2 ? parseCount((*entry)[1]) : std::nullopt;
  if (!value)
    corrupt(name + " is not a count");
  return value;
}

/// SIZE, TYPE or COUNT: one word per field. Files before v0.6 have none of them.
const Words*
perField(const std::vector<Words>& entries, const std::string& name, std::size_t n)
{
  const Words* entry = find(entries, name);
  if (entry != nullptr && entry->size() != n + 1)
    corrupt(fmt::format("{} has {} values for {} fields", name, entry->size() - 1, n));
  return entry;
}

ScalarType
parseType(const Words* size, const Words* type, std::size_t i)
{
  ScalarType scalar; // float, when the header does not say
  if (size != nullptr)
    scalar.size = static_cast<int>(
        std::min<std::uint64_t>(parseCount((*size)[i]).value_or(0), 9));
  if (type == nullptr)
    return scalar;
  const std::string name = lower((*type)[i]);
  scalar.kind = name == "f"                ? 'F' :
                name == "i"                ? 'I' :
                name == "u" || name == "b" ? 'U' : // b: bool
                                             '?';
  return scalar;
}

std::vector<Field>
parseFields(const std::vector<Words>& entries)
{
  const Words* names = find(entries, "FIELDS");
  if (names == nullptr)
    names = find(entries, "COLUMNS");
  if (names == nullptr)
    corrupt("no FIELDS");
  const std::size_t n = names->size() - 1;
  const Words* sizes = perField(entries, "SIZE", n);
  const Words* types = perField(entries, "TYPE", n);
  const Words* counts = perField(entries, "COUNT", n);
  std::vector<Field> fields(n);
  for (std::size_t i = 0; i < n; ++i) {
    fields[i].name = (*names)[i + 1];
    fields[i].type = parseType(sizes, types, i + 1);
    if (!fields[i].type.isValid())
      corrupt("field " + printable(fields[i].name) + " has no valid TYPE and SIZE");
    // The largest real fields are histograms of some thousand bins; 0 is a column that
    // is not there.
    constexpr std::uint64_t kTooMany = 1000001;
    if (counts != nullptr)
      fields[i].count = parseCount((*counts)[i + 1]).value_or(kTooMany);
    if (fields[i].count >= kTooMany)
      corrupt("COUNT of field " + printable(fields[i].name) + " is impossible");
  }
  return fields;
}

std::optional<Pose>
parseViewpoint(const Words& entry, std::vector<std::string>& notices)
{
  std::array<double, 7> v{};
  bool complete = entry.size() > v.size();
  for (std::size_t i = 0; complete && i < v.size(); ++i) {
    const auto value = parseNumber(entry[i + 1]);
    complete = value.has_value();
    v[i] = value.value_or(0.0);
  }
  const Eigen::Quaterniond q(v[3], v[4], v[5], v[6]);
  const Eigen::Vector3d c(v[0], v[1], v[2]);
  if (!complete || !c.allFinite() || !(q.norm() > 1e-6) || !std::isfinite(q.norm())) {
    notices.emplace_back("VIEWPOINT is not a pose; taken as not given");
    return std::nullopt;
  }
  return Pose{q.normalized().toRotationMatrix(), c};
}

void
noteUnknownEntries(const std::vector<Words>& entries, std::vector<std::string>& notices)
{
  constexpr std::array<std::string_view, 11> kNames{"VERSION",
                                                    "FIELDS",
                                                    "COLUMNS",
                                                    "SIZE",
                                                    "TYPE",
                                                    "COUNT",
                                                    "WIDTH",
                                                    "HEIGHT",
                                                    "VIEWPOINT",
                                                    "POINTS",
                                                    "DATA"};
  std::string unknown;
  int n = 0;
  for (const Words& entry : entries)
    if (std::find(kNames.begin(), kNames.end(), entry[0]) == kNames.end() && n++ == 0)
      unknown = printable(entry[0]);
  if (n > 0)
    notices.push_back(fmt::format("{} unknown header line{} ignored, the first: '{}'",
                                  n,
                                  n > 1 ? "s" : "",
                                  unknown));
}

/// Width, height and number of points, as PCL sees them: WIDTH and HEIGHT came with
/// v0.6, before there were POINTS alone.
void
parseSize(const std::vector<Words>& entries, Header& header)
{
  const auto width = countEntry(entries, "WIDTH");
  const auto announced = countEntry(entries, "POINTS");
  header.height = countEntry(entries, "HEIGHT").value_or(1);
  if (!width && !announced)
    corrupt("neither WIDTH nor POINTS");
  if (header.height == 0)
    header.height = 1;
  header.width = width.value_or(0);
  if (header.width == 0 && header.height == 1)
    header.width = announced.value_or(0);
  const auto points = product(header.width, header.height);
  // Indices of points are of type int everywhere.
  if (!points || *points > 0x7fffffffU)
    corrupt("WIDTH x HEIGHT is impossibly large");
  header.points = *points;
  if (announced.value_or(header.points) != header.points)
    corrupt("POINTS is not WIDTH x HEIGHT");
}

Header
parseHeader(std::string_view& bytes)
{
  const std::vector<Words> entries = headerEntries(bytes);
  Header header;
  noteUnknownEntries(entries, header.notices);
  header.fields = parseFields(entries);
  for (Field& field : header.fields) {
    field.offset = header.point_bytes;
    field.column = header.columns;
    header.point_bytes += field.bytes();
    header.columns += field.count;
  }
  parseSize(entries, header);
  if (const Words* viewpoint = find(entries, "VIEWPOINT"))
    header.viewpoint = parseViewpoint(*viewpoint, header.notices);
  const Words& data = entries.back();
  header.data = data.size() >= 2 ? lower(data[1]) : std::string();
  return header;
}

/// The fields the fit can use.
struct WantedFields {
  const Field* x = nullptr;
  const Field* y = nullptr;
  const Field* z = nullptr;
  const Field* covariance = nullptr;
  const Field* color = nullptr; ///< where the caller asks for it

  std::array<const Field*, 5> all() const
  {
    return {x, y, z, covariance, color};
  }
};

/// The field of this name; in capitals, when there is none in small letters.
const Field*
fieldNamed(const Header& header, const std::string& name)
{
  const Field* found = nullptr;
  for (const bool any_case : {false, true}) {
    for (const Field& field : header.fields) {
      if (any_case ? lower(field.name) != name : field.name != name)
        continue;
      if (found != nullptr)
        corrupt("two fields " + name);
      found = &field;
    }
    if (found != nullptr)
      break;
  }
  return found;
}

/// Red, green and blue in one value of four bytes, as PCL packs them.
const Field*
colorField(const Header& header)
{
  for (const Field& field : header.fields)
    if ((field.name == "rgb" || field.name == "rgba") && field.count == 1 &&
        field.type.size == 4)
      return &field;
  return nullptr;
}

WantedFields
wantedFields(const Header& header, const LoadOptions& options)
{
  const WantedFields wanted{fieldNamed(header, "x"),
                            fieldNamed(header, "y"),
                            fieldNamed(header, "z"),
                            fieldNamed(header, "covariance"),
                            options.colors ? colorField(header) : nullptr};
  for (const Field* field : {wanted.x, wanted.y, wanted.z}) {
    if (field == nullptr)
      throw std::runtime_error("has no fields x, y and z");
    if (field->count != 1)
      corrupt(fmt::format("field {} has COUNT {}, not 1", field->name, field->count));
  }
  if (wanted.covariance != nullptr && wanted.covariance->count != 6 &&
      wanted.covariance->count != 9)
    corrupt(fmt::format("field covariance has COUNT {}, not 6 (xx xy xz yy yz zz) or 9",
                        wanted.covariance->count));
  return wanted;
}

/// True when coordinates may have more digits than float.
bool
exceedFloat(const WantedFields& wanted, bool ascii)
{
  const auto is_float = [](const Field* field) {
    return field->type.size < 4 || (field->type.kind == 'F' && field->type.size == 4);
  };
  return ascii || !is_float(wanted.x) || !is_float(wanted.y) || !is_float(wanted.z);
}

/// The upper triangle (COUNT 6) or the whole matrix (COUNT 9).
/// \throw std::runtime_error when the matrix is not symmetric.
template <typename Number>
Eigen::Matrix3f
covarianceOf(const Number& number, std::uint64_t count, std::size_t point)
{
  Eigen::Matrix3d s;
  if (count == 6) {
    s << number(0), number(1), number(2), number(1), number(3), number(4), number(2),
        number(4), number(5);
    return s.cast<float>();
  }
  for (int k = 0; k < 9; ++k)
    s(k / 3, k % 3) = number(static_cast<std::size_t>(k));
  // Text of few digits rounds both halves alike.
  if ((s - s.transpose()).cwiseAbs().maxCoeff() > 1e-5 * s.cwiseAbs().maxCoeff())
    throw std::runtime_error(fmt::format("the covariance of point {} is not symmetric: "
                                         "nine numbers are read row by row",
                                         point));
  return s.cast<float>();
}

/// Where the values of a field are.
struct Column {
  const char* first = nullptr;
  std::size_t stride = 0; ///< bytes from point to point
  ScalarType type;

  const char* at(std::size_t point, std::size_t element = 0) const
  {
    return first + point * stride + element * static_cast<std::size_t>(type.size);
  }

  double value(std::size_t point, std::size_t element = 0) const
  {
    return type.read(at(point, element));
  }
};

using Axes = std::array<Column, 3>;

/// Appends n points from coordinate(axis, point); by blocks, since to append one by one
/// takes longer than to read them.
template <typename Coordinate>
void
appendPoints(std::size_t n, const Coordinate& coordinate, RawCloud& cloud)
{
  std::array<pcl::PointXYZ, 256> block;
  auto& points = cloud.points->points;
  points.reserve(n);
  for (std::size_t first = 0; first < n; first += block.size()) {
    const std::size_t count = std::min(block.size(), n - first);
    for (std::size_t i = 0; i < count; ++i)
      for (std::size_t k = 0; k < 3; ++k)
        block[i].data[k] = coordinate(k, first + i);
    points.insert(points.end(), block.data(), block.data() + count);
  }
}

/// Single precision stays what it is.
template <typename Scale>
void
appendFloats(const Axes& xyz, std::size_t n, const Scale& scale, RawCloud& cloud)
{
  appendPoints(
      n,
      [&xyz, &scale](std::size_t k, std::size_t i) {
        float value;
        std::memcpy(&value, xyz[k].at(i), sizeof(value));
        return scale(value);
      },
      cloud);
}

void
fillPositions(const Axes& xyz, std::size_t n, bool exceed_float, RawCloud& cloud)
{
  const double unit = cloud.info.unit_m;
  const auto in_m = [unit](double value) { return static_cast<float>(unit * value); };
  const bool all_floats = std::all_of(xyz.begin(), xyz.end(), [](const Column& column) {
    return column.type.kind == 'F' && column.type.size == 4;
  });
  if (exceed_float) {
    std::vector<double> values(3 * n);
    for (std::size_t i = 0; i < values.size(); ++i)
      values[i] = unit * xyz[i % 3].value(i / 3);
    cloud.points->points.resize(n);
    placePoints(values, cloud);
  }
  else if (all_floats && unit == 1.0)
    appendFloats(
        xyz,
        n,
        [](float value) { return value; },
        cloud);
  else if (all_floats)
    appendFloats(xyz, n, in_m, cloud);
  else
    appendPoints(
        n,
        [&](std::size_t k, std::size_t i) { return in_m(xyz[k].value(i)); },
        cloud);
}

void
fillCovariances(const Column& covariance, std::uint64_t count, RawCloud& cloud)
{
  const double unit = cloud.info.unit_m;
  cloud.covariances.resize(cloud.points->size());
  for (std::size_t i = 0; i < cloud.covariances.size(); ++i)
    cloud.covariances[i] = covarianceOf(
        [&](std::size_t k) { return unit * unit * covariance.value(i, k); },
        count,
        i);
}

/// A field of floats holds the bits of the colour, one of integers its value.
std::uint32_t
packedColor(const Field& field, const Column& color, std::size_t point)
{
  std::uint32_t bits = 0;
  if (field.type.kind != 'F')
    return static_cast<std::uint32_t>(static_cast<std::int64_t>(color.value(point)));
  if (color.type.size == 4) { // of which many are NaN: no arithmetic
    std::memcpy(&bits, color.at(point), sizeof(bits));
    return bits;
  }
  const auto number = static_cast<float>(color.value(point)); // of text
  std::memcpy(&bits, &number, sizeof(bits));
  return bits;
}

void
fillColors(const Field& field, const Column& color, RawCloud& cloud)
{
  auto& colors = cloud.info.colors;
  colors.resize(cloud.points->size());
  for (std::size_t i = 0; i < colors.size(); ++i) {
    const std::uint32_t bits = packedColor(field, color, i);
    for (std::size_t k = 0; k < 3; ++k)
      colors[i][k] = static_cast<std::uint8_t>(bits >> (16U - 8U * k) & 0xffU);
  }
}

/// Fills the cloud from `column(field)`.
template <typename ColumnOf>
void
fillCloud(const Header& header,
          const WantedFields& wanted,
          bool ascii,
          const ColumnOf& column,
          RawCloud& cloud)
{
  cloud.points->width = static_cast<std::uint32_t>(header.width);
  cloud.points->height = static_cast<std::uint32_t>(header.height);
  fillPositions({column(*wanted.x), column(*wanted.y), column(*wanted.z)},
                header.points,
                exceedFloat(wanted, ascii),
                cloud);
  if (wanted.covariance != nullptr)
    fillCovariances(column(*wanted.covariance), wanted.covariance->count, cloud);
  if (wanted.color != nullptr)
    fillColors(*wanted.color, column(*wanted.color), cloud);
}

/// The numbers of text that are used, row by row; one row per point.
struct Table {
  /// Per column of the file: its place in a row of `values`, or -1.
  std::vector<int> slots;
  std::size_t row_values = 0;
  std::vector<double> values;
  std::size_t longest_row = 0; ///< words in a line
};

/// Columns that nobody uses need not hold numbers.
Table
wantedColumns(const Header& header, const WantedFields& wanted)
{
  Table table;
  table.slots.assign(header.columns, -1);
  for (const Field* field : wanted.all())
    for (std::uint64_t k = 0; field != nullptr && k < field->count; ++k)
      table.slots[field->column + k] = static_cast<int>(table.row_values++);
  return table;
}

void
parseRow(std::string_view line, std::size_t row, Table& table)
{
  std::size_t column = 0;
  double* values = table.values.data() + row * table.row_values;
  for (auto word = takeWord(line); !word.empty(); word = takeWord(line), ++column) {
    if (column >= table.slots.size() || table.slots[column] < 0)
      continue;
    const auto value = parseNumber(word);
    if (!value)
      throw std::runtime_error(
          fmt::format("corrupt: point {} has a value that is not a number", row));
    values[table.slots[column]] = *value;
  }
  if (column < table.slots.size())
    throw std::runtime_error(
        fmt::format("truncated or corrupt: point {} has {} values instead of {}",
                    row,
                    column,
                    table.slots.size()));
  table.longest_row = std::max(table.longest_row, column);
}

bool
isBlank(std::string_view line)
{
  return takeWord(line).empty();
}

/// Fills the table.
/// \return what was left over, as a notice for each.
std::vector<std::string>
parseRows(std::string_view data, std::size_t rows, Table& table)
{
  const std::size_t columns = table.slots.size();
  table.values.resize(rows * table.row_values);
  const char line_end = lineEnd(data);
  std::size_t row = 0;
  std::size_t surplus = 0;
  while (const auto line = takeLine(data, line_end)) {
    if (isBlank(*line))
      continue;
    if (row == rows)
      ++surplus;
    else
      parseRow(*line, row++, table);
  }
  if (row < rows)
    throw std::runtime_error(fmt::format("truncated: {} of {} points", row, rows));
  std::vector<std::string> notices;
  if (surplus > 0)
    notices.push_back(
        fmt::format("{} more row{} than the {} points announced: not used",
                    surplus,
                    surplus > 1 ? "s" : "",
                    rows));
  if (table.longest_row > columns)
    notices.push_back(fmt::format(
        "rows of up to {} values where the header announces {}: the first {} are used",
        table.longest_row,
        columns,
        columns));
  return notices;
}

void
readAscii(std::string_view data,
          const Header& header,
          const WantedFields& wanted,
          RawCloud& cloud)
{
  // Every value takes a digit and a blank or line end at least.
  const auto values = product(header.points, header.columns);
  if (!values || *values > (data.size() + 1) / 2)
    throw std::runtime_error(
        fmt::format("truncated: too short for {} points", header.points));
  Table table = wantedColumns(header, wanted);
  for (const std::string& notice : parseRows(data, header.points, table))
    cloud.info.notices.push_back(notice);
  fillCloud(
      header,
      wanted,
      true,
      [&table](const Field& field) {
        const double* first = table.values.data() + table.slots[field.column];
        return Column{reinterpret_cast<const char*>(first),
                      table.row_values * sizeof(double),
                      ScalarType{'F', sizeof(double)}};
      },
      cloud);
}

/// Some writers pad with zeros.
bool
isPadding(std::string_view surplus)
{
  return surplus.find_first_not_of('\0') == std::string_view::npos;
}

void
noteSurplus(std::string_view surplus, RawCloud& cloud)
{
  if (!isPadding(surplus))
    cloud.info.notices.push_back(
        fmt::format("{} bytes behind the last point: not used", surplus.size()));
}

/// Surplus data may mean that the header is wrong.
void
judgeSurplus(std::string_view surplus, const Header& header, RawCloud& cloud)
{
  // In a small cloud that may be chance.
  if (header.points >= 1000 && surplus.size() % header.points == 0 &&
      !isPadding(surplus))
    throw std::runtime_error(
        fmt::format("corrupt: {} bytes of data per point where the header announces {}",
                    header.point_bytes + surplus.size() / header.points,
                    header.point_bytes));
  noteSurplus(surplus, cloud);
}

/// Points one after the other.
void
readBinary(std::string_view data,
           const Header& header,
           const WantedFields& wanted,
           RawCloud& cloud)
{
  const auto expected = product(header.points, header.point_bytes);
  if (!expected || *expected > data.size())
    throw std::runtime_error(
        fmt::format("truncated: {} bytes of data for {} points of {} bytes",
                    data.size(),
                    header.points,
                    header.point_bytes));
  judgeSurplus(data.substr(*expected), header, cloud);
  fillCloud(
      header,
      wanted,
      false,
      [&](const Field& field) {
        return Column{data.data() + field.offset, header.point_bytes, field.type};
      },
      cloud);
}

/// Two sizes of 32 bits, then the LZF stream. `data` is left at what follows.
std::unique_ptr<char[]>
decompress(std::string_view& data, std::uint64_t expected)
{
  constexpr std::size_t kSizes = 8;
  if (data.size() < kSizes)
    throw std::runtime_error("truncated: no compressed data");
  const ScalarType word{'U', 4};
  const auto compressed = static_cast<std::uint64_t>(word.read(data.data()));
  const auto uncompressed = static_cast<std::uint64_t>(word.read(data.data() + 4));
  data.remove_prefix(kSizes);
  if (compressed > data.size())
    throw std::runtime_error(
        fmt::format("truncated: {} of {} compressed bytes", data.size(), compressed));
  // Three bytes of LZF stand for 264 bytes at most.
  if (uncompressed != expected || uncompressed / 88 > compressed)
    throw std::runtime_error("corrupt: compressed data of another size than the header "
                             "announces");
  std::unique_ptr<char[]> plain(new char[uncompressed]); // not zeros first
  if (!lzfDecompress(data.substr(0, compressed), plain.get(), uncompressed))
    throw std::runtime_error("corrupt: compressed data cannot be unpacked");
  data.remove_prefix(compressed);
  return plain;
}

/// Compressed, field after field.
void
readCompressed(std::string_view data,
               const Header& header,
               const WantedFields& wanted,
               RawCloud& cloud)
{
  const auto expected = product(header.points, header.point_bytes);
  if (!expected || *expected > 0xffffffffU)
    corrupt("more data than compression allows");
  const std::unique_ptr<char[]> plain = decompress(data, *expected);
  noteSurplus(data, cloud);
  fillCloud(
      header,
      wanted,
      false,
      [&](const Field& field) {
        return Column{plain.get() + field.offset * header.points,
                      field.bytes(),
                      field.type};
      },
      cloud);
}

} // namespace

RawCloud
readPcd(std::string_view bytes, const LoadOptions& options)
{
  Header header = parseHeader(bytes);
  const WantedFields wanted = wantedFields(header, options);
  if (header.points == 0)
    throw std::runtime_error("holds no points");
  checkPointCount(header.points, options.max_points);
  RawCloud cloud;
  cloud.info.unit_m = options.unit_m;
  cloud.info.viewpoint = header.viewpoint;
  if (cloud.info.viewpoint)
    cloud.info.viewpoint->c *= options.unit_m;
  cloud.info.notices = std::move(header.notices);
  if (header.data == "ascii")
    readAscii(bytes, header, wanted, cloud);
  else if (header.data == "binary")
    readBinary(bytes, header, wanted, cloud);
  else if (header.data == "binary_compressed")
    readCompressed(bytes, header, wanted, cloud);
  else
    corrupt("DATA is none of ascii, binary, binary_compressed");
  cloud.info.format = "PCD " + header.data;
  for (const Field& field : header.fields)
    cloud.info.fields.push_back(field.name);
  return cloud;
}

} // namespace holdfast::io
