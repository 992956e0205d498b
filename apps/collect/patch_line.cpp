#include "patch_line.h"

#include <holdfast/fit/names.h>
#include <holdfast/patch/names.h>
#include <holdfast/validation/names.h>

#include <charconv>
#include <limits>
#include <stdexcept>

namespace holdfast::app {
namespace {

/// Goes through JSON from left to right.
class Scanner {
public:
  explicit Scanner(std::string_view text)
  : at_(text.data()), end_(text.data() + text.size())
  {}

  /// The next character that is not blank; 0 at the end.
  char peek()
  {
    while (at_ != end_ && (*at_ == ' ' || *at_ == '\t' || *at_ == '\r' || *at_ == '\n'))
      ++at_;
    return at_ == end_ ? '\0' : *at_;
  }

  bool accept(char c)
  {
    if (peek() != c)
      return false;
    ++at_;
    return true;
  }

  void expect(char c)
  {
    if (!accept(c))
      fail();
  }

  /// A word as it stands there; those that matter have no backslash in them.
  std::string_view word()
  {
    expect('"');
    const char* const begin = at_;
    for (; at_ != end_ && *at_ != '"'; ++at_)
      if (*at_ == '\\' && ++at_ == end_)
        fail();
    const std::string_view found(begin, static_cast<std::size_t>(at_ - begin));
    expect('"');
    return found;
  }

  bool acceptNull()
  {
    return peek() == 'n' && acceptLiteral("null");
  }

  bool boolean()
  {
    if (peek() == 't' && acceptLiteral("true"))
      return true;
    if (!acceptLiteral("false"))
      fail();
    return false;
  }

  /// NaN for null.
  double number()
  {
    if (acceptNull())
      return kNoNumber;
    return parsed<double>();
  }

  std::int32_t wholeNumber()
  {
    peek();
    return parsed<std::int32_t>();
  }

  /// Calls each(index) before every element of an array.
  template <typename Each>
  std::size_t array(const Each& each)
  {
    std::size_t count = 0;
    expect('[');
    if (accept(']'))
      return 0;
    do
      each(count++);
    while (accept(','));
    expect(']');
    return count;
  }

  /// Calls each(NAME) before the value of every member of an object.
  template <typename Each>
  void object(const Each& each)
  {
    expect('{');
    if (accept('}'))
      return;
    do {
      const std::string_view name = word();
      expect(':');
      each(name);
    } while (accept(','));
    expect('}');
  }

  /// Any value.
  void skip()
  {
    int depth = 0;
    do {
      const char c = peek();
      if (c == '"') {
        word();
        continue;
      }
      if (c == '\0')
        fail();
      if (c == '[' || c == '{')
        ++depth;
      if (c == ']' || c == '}')
        --depth;
      ++at_;
    } while (depth > 0 || (at_ != end_ && *at_ != ',' && *at_ != '}' && *at_ != ']'));
  }

  [[noreturn]] static void fail()
  {
    throw std::runtime_error("a patch is not as holdfast writes it");
  }

private:
  bool acceptLiteral(std::string_view literal)
  {
    if (std::string_view(at_, static_cast<std::size_t>(end_ - at_))
            .substr(0, literal.size()) != literal)
      return false;
    at_ += literal.size();
    return true;
  }

  template <typename Number>
  Number parsed()
  {
    peek();
    Number value{};
    const auto result = std::from_chars(at_, end_, value);
    if (result.ec != std::errc())
      fail();
    at_ = result.ptr;
    return value;
  }

  const char* at_;
  const char* end_;
};

template <typename Names>
std::uint8_t
enumValue(const Names& names, Scanner& in)
{
  const auto value = names.find(in.word());
  if (!value)
    Scanner::fail();
  return static_cast<std::uint8_t>(*value);
}

template <std::size_t n>
std::size_t
readVector(Scanner& in, std::array<double, n>& out)
{
  return in.array([&](std::size_t i) {
    if (i >= n)
      Scanner::fail();
    out[i] = in.number();
  });
}

void
readState(Scanner& in, PatchRow& row)
{
  const std::size_t n = readVector(in, row.state);
  if (n == 0)
    return;
  if (n < 3)
    Scanner::fail();
  for (std::size_t i = 0; i < 3; ++i)
    row.centre[i] = row.state[n - 3 + i];
}

void
readTriangle(Scanner& in, PatchRow& row)
{
  in.array([&](std::size_t i) {
    if (i >= static_cast<std::size_t>(kMaxState))
      Scanner::fail();
    in.array([&](std::size_t j) {
      if (j <= i)
        row.state_covariance[i * (i + 1) / 2 + j] = in.number();
      else
        in.skip();
    });
  });
}

void
readFrame(Scanner& in, PatchRow& row)
{
  in.array([&](std::size_t i) {
    std::array<double, 3> values{};
    readVector(in, values);
    if (i >= 3)
      Scanner::fail();
    row.x_axis[i] = values[0];
    row.normal[i] = values[2];
  });
}

void
readFlags(Scanner& in, PatchRow& row)
{
  in.array([&](std::size_t) {
    const std::string_view name = in.word();
    for (std::size_t i = 0; i < kFitFlagNames.size(); ++i)
      if (kFitFlagNames[i].name == name)
        row.flags = static_cast<std::uint8_t>(row.flags | (1U << i));
  });
}

void
readResidual(Scanner& in, PatchRow& row)
{
  if (in.acceptNull())
    return;
  in.object([&](std::string_view name) {
    const auto value = static_cast<float>(in.number());
    if (name == "rms")
      row.residual_rms = value;
    else if (name == "largest")
      row.residual_largest = value;
    else if (name == "unexplained")
      row.residual_unexplained = value;
  });
}

void
readMeasured(Scanner& in, PatchRow& row)
{
  if (in.acceptNull())
    return;
  in.object([&](std::string_view name) {
    const auto value = static_cast<float>(in.number());
    if (name == "extent")
      row.extent = value;
    else if (name == "sagitta")
      row.sagitta = value;
    else if (name == "curvature")
      row.curvature = value;
    else if (name == "noise")
      row.noise = value;
    else if (name == "view_angle")
      row.view_angle = value;
    else if (name == "stray")
      row.stray = value;
  });
}

void
readSeed(Scanner& in, PatchRow& row)
{
  if (in.acceptNull())
    return;
  in.object([&](std::string_view name) {
    if (name == "index")
      row.seed_index = in.wholeNumber();
    else if (name == "point")
      readVector(in, row.seed);
    else
      in.skip();
  });
}

struct Member {
  std::string_view name;
  void (*read)(Scanner&, PatchRow&);
};

/// In the order of writeJson(), so that the next one is mostly the one looked for.
constexpr std::array kMembers{
    Member{
        "surface",
        [](Scanner& in, PatchRow& row) { row.surface = enumValue(kSurfaceNames, in); }},
    Member{"boundary",
           [](Scanner& in, PatchRow& row) {
             row.boundary = enumValue(kBoundaryNames, in);
           }},
    Member{"parameters",
           [](Scanner& in, PatchRow& row) { readVector(in, row.parameters); }},
    Member{"flags", readFlags},
    Member{"nonlinearity",
           [](Scanner& in, PatchRow& row) {
             row.nonlinearity = static_cast<float>(in.number());
           }},
    Member{"state", readState},
    Member{"state_covariance", readTriangle},
    Member{"state_frame", readFrame},
    Member{
        "status",
        [](Scanner& in, PatchRow& row) { row.status = enumValue(kStatusNames, in); }},
    Member{"points", [](Scanner& in, PatchRow& row) { row.points = in.wholeNumber(); }},
    Member{"uninformative_points",
           [](Scanner& in, PatchRow& row) {
             row.uninformative_points = in.wholeNumber();
           }},
    Member{"chi2", [](Scanner& in, PatchRow& row) { row.chi2 = in.number(); }},
    Member{"chi2_dof",
           [](Scanner& in, PatchRow& row) { row.chi2_dof = in.wholeNumber(); }},
    Member{"chi2_expected",
           [](Scanner& in, PatchRow& row) { row.chi2_expected = in.number(); }},
    Member{"iterations",
           [](Scanner& in, PatchRow& row) { row.iterations = in.wholeNumber(); }},
    Member{"verdict",
           [](Scanner& in, PatchRow& row) {
             if (!in.acceptNull())
               row.verdict = enumValue(kVerdictNames, in);
           }},
    Member{"residual", readResidual},
    Member{"coverage",
           [](Scanner& in, PatchRow& row) {
             row.coverage = static_cast<float>(in.number());
           }},
    Member{"measured", readMeasured},
    Member{
        "second_attempt",
        [](Scanner& in, PatchRow& row) { row.second_attempt = in.boolean() ? 1 : 0; }},
    Member{"seed", readSeed},
    Member{"radius", [](Scanner& in, PatchRow& row) {
             row.radius = static_cast<float>(in.number());
           }}};

} // namespace

PatchRow
rowOfJson(std::string_view text)
{
  PatchRow row;
  Scanner in(text);
  std::size_t next = 0;
  bool has_state = false;
  in.object([&](std::string_view name) {
    for (std::size_t tried = 0; tried < kMembers.size(); ++tried) {
      const Member& member = kMembers[(next + tried) % kMembers.size()];
      if (member.name == name) {
        member.read(in, row);
        has_state = has_state || name == "state";
        next = (next + tried + 1) % kMembers.size();
        return;
      }
    }
    in.skip();
  });
  if (in.peek() != '\0' || !has_state)
    Scanner::fail();
  return row;
}

} // namespace holdfast::app
