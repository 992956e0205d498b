#include "cloud_readers.h"

#include <pcl/io/lzf.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>

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

/// The entries of the header, each split into words, up to and including DATA.
/// `bytes` is left at the data.
std::vector<std::vector<std::string_view>>
headerEntries(std::string_view& bytes)
{
  std::vector<std::vector<std::string_view>> entries;
  while (const auto line = takeLine(bytes)) {
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

std::uint64_t
countEntry(const std::vector<Words>& entries, const std::string& name)
{
  const Words* entry = find(entries, name);
  if (entry == nullptr)
    corrupt("no " + name);
  const auto value = entry->size() == 2 ? parseCount((*entry)[1]) : std::nullopt;
  if (!value)
    corrupt(name + " is no count");
  return *value;
}

/// SIZE, TYPE or COUNT: one word per field.
const Words&
perField(const std::vector<Words>& entries, const std::string& name, std::size_t n)
{
  const Words* entry = find(entries, name);
  if (entry == nullptr)
    corrupt("no " + name);
  if (entry->size() != n + 1)
    corrupt(name + " has " + std::to_string(entry->size() - 1) + " values for " +
            std::to_string(n) + " fields");
  return *entry;
}

std::vector<Field>
parseFields(const std::vector<Words>& entries)
{
  const Words* names = find(entries, "FIELDS");
  if (names == nullptr)
    corrupt("no FIELDS");
  const std::size_t n = names->size() - 1;
  const Words& sizes = perField(entries, "SIZE", n);
  const Words& types = perField(entries, "TYPE", n);
  const Words* counts =
      find(entries, "COUNT") != nullptr ? &perField(entries, "COUNT", n) : nullptr;
  std::vector<Field> fields(n);
  for (std::size_t i = 0; i < n; ++i) {
    fields[i].name = (*names)[i + 1];
    fields[i].type.size = static_cast<int>(
        std::min<std::uint64_t>(parseCount(sizes[i + 1]).value_or(0), 9));
    fields[i].type.kind = types[i + 1].size() == 1 ? types[i + 1][0] : '?';
    if (!fields[i].type.isValid())
      corrupt("field " + fields[i].name + " has no valid TYPE and SIZE");
    fields[i].count = counts ? parseCount((*counts)[i + 1]).value_or(0) : 1;
    // The largest real fields are histograms of some thousand bins.
    if (fields[i].count < 1 || fields[i].count > 1000000)
      corrupt("COUNT of field " + fields[i].name + " is impossible");
  }
  return fields;
}

std::optional<Pose>
parseViewpoint(const Words& entry, std::vector<std::string>& notices)
{
  std::array<double, 7> v{};
  if (entry.size() != v.size() + 1)
    corrupt("VIEWPOINT has " + std::to_string(entry.size() - 1) + " values, not 7");
  for (std::size_t i = 0; i < v.size(); ++i) {
    const auto value = parseNumber(entry[i + 1]);
    if (!value)
      corrupt("VIEWPOINT is not made of numbers");
    v[i] = *value;
  }
  const Eigen::Quaterniond q(v[3], v[4], v[5], v[6]);
  const Eigen::Vector3d c(v[0], v[1], v[2]);
  if (!c.allFinite() || !(q.norm() > 1e-6) || !std::isfinite(q.norm())) {
    notices.emplace_back("VIEWPOINT is no pose; taken as the identity");
    return std::nullopt;
  }
  return Pose{q.normalized().toRotationMatrix(), c};
}

void
checkNames(const std::vector<Words>& entries)
{
  constexpr std::array<std::string_view, 10> kNames{"VERSION",
                                                    "FIELDS",
                                                    "SIZE",
                                                    "TYPE",
                                                    "COUNT",
                                                    "WIDTH",
                                                    "HEIGHT",
                                                    "VIEWPOINT",
                                                    "POINTS",
                                                    "DATA"};
  for (const Words& entry : entries)
    if (std::find(kNames.begin(), kNames.end(), entry[0]) == kNames.end())
      corrupt("unknown entry '" + std::string(entry[0].substr(0, 20)) + "'");
}

/// Width, height and number of points; HEIGHT and POINTS were optional before v0.7.
void
parseSize(const std::vector<Words>& entries, Header& header)
{
  header.width = countEntry(entries, "WIDTH");
  if (find(entries, "HEIGHT") != nullptr)
    header.height = countEntry(entries, "HEIGHT");
  const auto points = product(header.width, header.height);
  // Indices of points are of type int everywhere.
  if (!points || *points > 0x7fffffffU)
    corrupt("WIDTH x HEIGHT is impossibly large");
  header.points = *points;
  if (find(entries, "POINTS") != nullptr &&
      countEntry(entries, "POINTS") != header.points)
    corrupt("POINTS is not WIDTH x HEIGHT");
}

Header
parseHeader(std::string_view& bytes)
{
  const std::vector<Words> entries = headerEntries(bytes);
  checkNames(entries);
  Header header;
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
  header.data = data.size() == 2 ? data[1] : std::string_view();
  return header;
}

/// The fields the fit can use.
struct WantedFields {
  const Field* x = nullptr;
  const Field* y = nullptr;
  const Field* z = nullptr;
  const Field* covariance = nullptr;
};

WantedFields
wantedFields(const Header& header)
{
  WantedFields wanted;
  for (const Field& field : header.fields) {
    const Field** slot = field.name == "x"          ? &wanted.x :
                         field.name == "y"          ? &wanted.y :
                         field.name == "z"          ? &wanted.z :
                         field.name == "covariance" ? &wanted.covariance :
                                                      nullptr;
    if (slot == nullptr)
      continue;
    if (*slot != nullptr)
      corrupt("two fields " + field.name);
    if (field.count != (field.name == "covariance" ? 6U : 1U))
      corrupt("field " + field.name + " has COUNT " + std::to_string(field.count) +
              (field.name == "covariance" ? ", not 6" : ", not 1"));
    *slot = &field;
  }
  if (wanted.x == nullptr || wanted.y == nullptr || wanted.z == nullptr)
    throw std::runtime_error("has no fields x, y and z");
  return wanted;
}

/// Fills the cloud from `value(field, point, element)`.
template <typename Value>
void
fillPoints(const WantedFields& wanted, const Value& value, RawCloud& cloud)
{
  const auto number = [&](const Field* field, std::size_t i, std::size_t element = 0) {
    return static_cast<float>(value(*field, i, element));
  };
  auto& points = *cloud.points;
  for (std::size_t i = 0; i < points.size(); ++i)
    points[i].getVector3fMap() << number(wanted.x, i), number(wanted.y, i),
        number(wanted.z, i);
  if (wanted.covariance == nullptr)
    return;
  cloud.covariances.resize(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    std::array<float, 6> s; // xx xy xz yy yz zz
    for (std::size_t k = 0; k < s.size(); ++k)
      s[k] = number(wanted.covariance, i, k);
    cloud.covariances[i] << s[0], s[1], s[2], s[1], s[3], s[4], s[2], s[4], s[5];
  }
}

void
resize(RawCloud& cloud, const Header& header)
{
  cloud.points->resize(header.points);
  cloud.points->width = static_cast<std::uint32_t>(header.width);
  cloud.points->height = static_cast<std::uint32_t>(header.height);
}

/// The numbers of the text, row by row; one row per point.
std::vector<double>
parseTable(std::string_view data, std::size_t rows, std::size_t columns)
{
  // Every value takes a digit and a blank or line end at least.
  const auto values = product(rows, columns);
  if (!values || *values > (data.size() + 1) / 2)
    throw std::runtime_error("truncated: too short for " + std::to_string(rows) +
                             " points");
  std::vector<double> table;
  table.reserve(*values);
  while (const auto line = takeLine(data)) {
    const std::string point = "point " + std::to_string(table.size() / columns);
    const Words words = splitWords(*line);
    if (words.empty())
      continue;
    if (table.size() == *values)
      throw std::runtime_error("corrupt: more rows than the " + std::to_string(rows) +
                               " points announced");
    if (words.size() != columns)
      throw std::runtime_error("truncated or corrupt: " + point + " has " +
                               std::to_string(words.size()) + " values instead of " +
                               std::to_string(columns));
    for (const auto word : words) {
      const auto value = parseNumber(word);
      if (!value)
        throw std::runtime_error("corrupt: " + point +
                                 " has a value that is no number");
      table.push_back(*value);
    }
  }
  if (table.size() < *values)
    throw std::runtime_error("truncated: " + std::to_string(table.size() / columns) +
                             " of " + std::to_string(rows) + " points");
  return table;
}

void
readAscii(std::string_view data,
          const Header& header,
          const WantedFields& wanted,
          RawCloud& cloud)
{
  const std::vector<double> table = parseTable(data, header.points, header.columns);
  resize(cloud, header);
  fillPoints(
      wanted,
      [&](const Field& field, std::size_t i, std::size_t element) {
        return table[i * header.columns + field.column + element];
      },
      cloud);
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
    throw std::runtime_error("truncated: " + std::to_string(data.size()) +
                             " bytes of data for " + std::to_string(header.points) +
                             " points of " + std::to_string(header.point_bytes) +
                             " bytes");
  // Some writers pad with zeros; anything else means that the header is wrong.
  if (data.find_first_not_of('\0', *expected) != std::string_view::npos)
    throw std::runtime_error("corrupt: more data than the header announces");
  resize(cloud, header);
  fillPoints(
      wanted,
      [&](const Field& field, std::size_t i, std::size_t element) {
        return field.type.read(data.data() + i * header.point_bytes + field.offset +
                               element * static_cast<std::size_t>(field.type.size));
      },
      cloud);
}

/// Two sizes of 32 bits, then the LZF stream.
std::vector<char>
decompress(std::string_view data, std::uint64_t expected)
{
  constexpr std::size_t kSizes = 8;
  if (data.size() < kSizes)
    throw std::runtime_error("truncated: no compressed data");
  const ScalarType word{'U', 4};
  const auto compressed = static_cast<std::uint64_t>(word.read(data.data()));
  const auto uncompressed = static_cast<std::uint64_t>(word.read(data.data() + 4));
  data.remove_prefix(kSizes);
  if (compressed > data.size())
    throw std::runtime_error("truncated: " + std::to_string(data.size()) + " of " +
                             std::to_string(compressed) + " compressed bytes");
  // Three bytes of LZF stand for 264 bytes at most.
  if (uncompressed != expected || uncompressed / 88 > compressed)
    throw std::runtime_error("corrupt: compressed data of another size than the header "
                             "announces");
  std::vector<char> plain(uncompressed);
  const unsigned int length =
      pcl::lzfDecompress(data.data(),
                         static_cast<unsigned int>(compressed),
                         plain.data(),
                         static_cast<unsigned int>(uncompressed));
  if (length != uncompressed)
    throw std::runtime_error("corrupt: compressed data cannot be unpacked");
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
  const std::vector<char> plain = decompress(data, *expected);
  resize(cloud, header);
  fillPoints(
      wanted,
      [&](const Field& field, std::size_t i, std::size_t element) {
        return field.type.read(plain.data() + field.offset * header.points +
                               i * field.bytes() +
                               element * static_cast<std::size_t>(field.type.size));
      },
      cloud);
}

} // namespace

RawCloud
readPcd(std::string_view bytes)
{
  Header header = parseHeader(bytes);
  const WantedFields wanted = wantedFields(header);
  if (header.points == 0)
    throw std::runtime_error("holds no points");
  RawCloud cloud;
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
  cloud.info.viewpoint = header.viewpoint;
  cloud.info.notices = std::move(header.notices);
  return cloud;
}

} // namespace holdfast::io
