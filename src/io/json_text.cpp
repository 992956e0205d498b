#include "json_text.h"

#include "parallel/thread_memory.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <vector>

namespace holdfast::io {
namespace {

/// Of a number with a comma, at most.
constexpr std::size_t kNumberSize = 32;

bool
isSame(double a, double b)
{
  return std::memcmp(&a, &b, sizeof a) == 0;
}

/// Where every number has room.
char*
print(double number, char* at)
{
  if (!std::isfinite(number)) {
    std::memcpy(at, "null", 4);
    return at + 4;
  }
  char* const end = std::to_chars(at, at + kNumberSize, number).ptr;
  // 1.0 is a number of another kind than 1, to many a reader.
  if (std::any_of(at, end, [](char c) { return c == '.' || c == 'e'; }))
    return end;
  std::memcpy(end, ".0", 2);
  return end + 2;
}

/// A number in a text.
struct Printed {
  const char* begin = nullptr;
  std::size_t size = 0;
};

} // namespace

void
appendJson(double number, std::string& out)
{
  char text[kNumberSize];
  out.append(text, print(number, text));
}

void
appendJson(std::string_view word, std::string& out)
{
  out += '"';
  out += word;
  out += '"';
}

void
appendJsonMatrix(const Eigen::Ref<const Eigen::MatrixXd>& matrix, std::string& out)
{
  // One append for all of it: those of single numbers add up.
  const Eigen::Index n = matrix.cols();
  const auto entries = static_cast<std::size_t>(matrix.size());
  auto& text = threadMemory<std::vector<char>, struct MatrixText>();
  auto& printed =
      threadMemory<std::vector<Printed>, struct PrintedRows>(); // row by row
  text.resize(std::max(text.size(),
                       kNumberSize * (entries + 1) +
                           3 * static_cast<std::size_t>(matrix.rows())));
  printed.resize(std::max(printed.size(), entries));
  char* at = text.data();
  *at++ = '[';
  for (Eigen::Index i = 0; i < matrix.rows(); ++i) {
    *at++ = '[';
    for (Eigen::Index j = 0; j < n; ++j) {
      Printed& entry = printed[static_cast<std::size_t>(i * n + j)];
      if (j < i && i < n && isSame(matrix(i, j), matrix(j, i))) {
        entry = printed[static_cast<std::size_t>(j * n + i)];
        std::memcpy(at, entry.begin, entry.size);
      }
      else
        entry = {at, static_cast<std::size_t>(print(matrix(i, j), at) - at)};
      at += entry.size;
      *at++ = ',';
    }
    at -= n > 0;
    *at++ = ']';
    *at++ = ',';
  }
  at -= matrix.rows() > 0;
  *at++ = ']';
  out.append(text.data(), at);
}

} // namespace holdfast::io
