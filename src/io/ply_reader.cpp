#include "cloud_readers.h"

#include <algorithm>
#include <array>
#include <map>

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
};

[[noreturn]] void
corrupt(const std::string& what)
{
  throw std::runtime_error("corrupt PLY header: " + what);
}

ScalarType
scalarType(std::string_view name)
{
  static const std::map<std::string_view, ScalarType> kTypes{{"char", {'I', 1}},
                                                             {"int8", {'I', 1}},
                                                             {"uchar", {'U', 1}},
                                                             {"uint8", {'U', 1}},
                                                             {"short", {'I', 2}},
                                                             {"int16", {'I', 2}},
                                                             {"ushort", {'U', 2}},
                                                             {"uint16", {'U', 2}},
                                                             {"int", {'I', 4}},
                                                             {"int32", {'I', 4}},
                                                             {"uint", {'U', 4}},
                                                             {"uint32", {'U', 4}},
                                                             {"float", {'F', 4}},
                                                             {"float32", {'F', 4}},
                                                             {"double", {'F', 8}},
                                                             {"float64", {'F', 8}}};
  const auto type = kTypes.find(name);
  if (type == kTypes.end())
    corrupt("unknown type '" + std::string(name.substr(0, 20)) + "'");
  return type->second;
}

Property
parseProperty(const std::vector<std::string_view>& words)
{
  if (words.size() == 3)
    return {std::string(words[2]), scalarType(words[1]), std::nullopt};
  if (words.size() != 5 || words[1] != "list")
    corrupt("a property is neither a number nor a list");
  const ScalarType length = scalarType(words[2]);
  if (length.kind == 'F')
    corrupt("a list has a length that is no integer");
  return {std::string(words[4]), scalarType(words[3]), length};
}

void
parseEntry(const std::vector<std::string_view>& words, Header& header)
{
  if (words[0] == "format" && words.size() == 3 && words[2] == "1.0") {
    header.format = words[1];
  }
  else if (words[0] == "element" && words.size() == 3 && parseCount(words[2])) {
    header.elements.push_back({std::string(words[1]), *parseCount(words[2]), {}});
  }
  else if (words[0] == "property" && !header.elements.empty()) {
    header.elements.back().properties.push_back(parseProperty(words));
  }
  else if (words[0] != "comment" && words[0] != "obj_info") {
    corrupt("cannot understand '" + std::string(words[0].substr(0, 20)) + "'");
  }
}

/// `bytes` is left at the data.
Header
parseHeader(std::string_view& bytes)
{
  Header header;
  if (takeLine(bytes).value_or("") != "ply")
    corrupt("the first line is not 'ply'");
  while (const auto line = takeLine(bytes)) {
    const auto words = splitWords(*line);
    if (words.empty())
      continue;
    if (words[0] != "end_header") {
      parseEntry(words, header);
      continue;
    }
    if (header.format != "ascii" && header.format != "binary_little_endian" &&
        header.format != "binary_big_endian")
      corrupt("no format ascii, binary_little_endian or binary_big_endian 1.0");
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
    const std::string_view word = takeWord(data_);
    if (word.empty())
      throw std::runtime_error("truncated: data end early");
    const auto value = parseNumber(word);
    if (!value)
      throw std::runtime_error("corrupt: a value is no number");
    return *value;
  }

  void skip(const Property& property)
  {
    if (!property.list_size) {
      next(property.type);
      return;
    }
    const double length = next(*property.list_size);
    if (!(length >= 0.0))
      throw std::runtime_error("corrupt: a list of negative length");
    // Ends with the data at the latest.
    for (double i = 0.0; i < length; ++i)
      next(property.type);
  }

  std::size_t remaining() const
  {
    return data_.size();
  }

  /// Nothing but blanks, or the zeros some writers pad with, may follow the last
  /// number; anything else means that the header is wrong.
  bool atEnd() const
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
};

/// Which properties of an element to keep: the index of each name, -1 where missing.
template <std::size_t N>
std::array<int, N>
indicesOf(const Element& element, const std::array<std::string_view, N>& names)
{
  std::array<int, N> indices;
  indices.fill(-1);
  for (std::size_t j = 0; j < element.properties.size(); ++j)
    for (std::size_t k = 0; k < N; ++k)
      if (element.properties[j].name == names[k] && !element.properties[j].list_size)
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
  return values;
}

void
readVertices(NumberSource& source, const Element& element, RawCloud& cloud)
{
  const auto wanted = indicesOf<3>(element, {"x", "y", "z"});
  if (std::find(wanted.begin(), wanted.end(), -1) != wanted.end())
    throw std::runtime_error("has no properties x, y and z");
  if (element.count > 0x7fffffffU)
    corrupt("an impossible number of vertices");
  cloud.points->resize(element.count);
  for (auto& point : *cloud.points) {
    const auto q = readRow(source, element, wanted);
    point.x = static_cast<float>(q[0]);
    point.y = static_cast<float>(q[1]);
    point.z = static_cast<float>(q[2]);
  }
  for (const Property& property : element.properties)
    cloud.info.fields.push_back(property.name);
}

/// The sensor pose as PCL writes it: the axes are the rows of the rotation matrix.
void
readCamera(NumberSource& source, const Element& element, RawCloud& cloud)
{
  const auto wanted = indicesOf<12>(element,
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
                                     "z_axisz"});
  const auto v = readRow(source, element, wanted);
  Pose pose;
  pose.c << v[0], v[1], v[2];
  pose.R << v[3], v[4], v[5], v[6], v[7], v[8], v[9], v[10], v[11];
  // Written with about six digits.
  const bool is_rotation =
      (pose.R * pose.R.transpose()).isIdentity(1e-3) && pose.R.determinant() > 0.0;
  if (pose.c.allFinite() && is_rotation)
    cloud.info.viewpoint = pose;
  else
    cloud.info.notices.emplace_back("camera is no pose; taken as the identity");
}

void
readElement(NumberSource& source, const Element& element, RawCloud& cloud)
{
  const auto least = product(element.count, source.leastRowBytes(element));
  if (!least || *least > source.remaining())
    throw std::runtime_error("truncated: too short for " +
                             std::to_string(element.count) + " x " + element.name);
  if (element.properties.empty() || element.count == 0)
    return;
  if (element.name == "vertex") {
    readVertices(source, element, cloud);
    return;
  }
  std::uint64_t row = 0;
  if (element.name == "camera") {
    readCamera(source, element, cloud);
    ++row;
  }
  for (; row < element.count; ++row)
    for (const Property& property : element.properties)
      source.skip(property);
}

} // namespace

RawCloud
readPly(std::string_view bytes)
{
  const Header header = parseHeader(bytes);
  NumberSource source(bytes, header.format);
  RawCloud cloud;
  for (const Element& element : header.elements)
    readElement(source, element, cloud);
  if (cloud.points->empty())
    throw std::runtime_error("holds no vertices");
  if (!source.atEnd())
    throw std::runtime_error("corrupt: more data than the header announces");
  cloud.info.format = "PLY " + header.format;
  return cloud;
}

} // namespace holdfast::io
