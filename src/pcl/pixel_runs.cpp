#include "pixel_runs.h"

#include <algorithm>

namespace holdfast {
namespace {

int
lowestBit(std::uint64_t word)
{
  return __builtin_ctzll(word);
}

/// The first bit of [begin, end) that is set after the words went through `changed`.
template <typename Change>
int
firstBit(const std::uint64_t* words, int begin, int end, const Change& changed)
{
  while (begin < end) {
    const int offset = begin % kWordBits;
    const std::uint64_t left = changed(words[begin / kWordBits]) >> offset;
    if (left != 0)
      return std::min(begin + lowestBit(left), end);
    begin += kWordBits - offset;
  }
  return end;
}

} // namespace

int
BitRow::firstSet(int begin, int end) const
{
  const auto same = [](std::uint64_t word) { return word; };
  return first_column + firstBit(words, begin - first_column, end - first_column, same);
}

int
BitRow::firstClear(int begin, int end) const
{
  const auto inverted = [](std::uint64_t word) { return ~word; };
  return first_column +
         firstBit(words, begin - first_column, end - first_column, inverted);
}

int
PixelRuns::rootOf(int i)
{
  while (runs_[i].parent != i)
    i = runs_[i].parent = runs_[runs_[i].parent].parent;
  return i;
}

/// Joins the runs [above, here) of one row with those after them, of the next, where
/// some pixel of both continues the surface; both lists ascend.
void
PixelRuns::joinRows(int above, int here, const BitRow& touches)
{
  const int end = static_cast<int>(runs_.size());
  int a = above;
  int b = here;
  while (a < here && b < end) {
    const int first = std::max(runs_[a].begin, runs_[b].begin);
    const int last = std::min(runs_[a].end, runs_[b].end);
    if (first < last && touches.firstSet(first, last) < last)
      runs_[rootOf(b)].parent = rootOf(a);
    if (runs_[a].end < runs_[b].end)
      ++a;
    else
      ++b;
  }
}

void
PixelRuns::addRow(int row, PixelRange columns)
{
  const int here = static_cast<int>(runs_.size());
  const int count = std::max(columns.end - columns.begin, 0);
  const auto words = static_cast<std::size_t>((count + kWordBits - 1) / kWordBits);
  if (bits_.size() < 3 * words)
    bits_.resize(3 * words);
  std::uint64_t* const first = bits_.data();
  const RowBits bits{first, first + words, first + 2 * words};
  const float* const value = values_.row(row) + columns.begin;
  compareNeighbors(value,
                   is_first_ ? value : value - values_.stride,
                   count,
                   jump_,
                   bits);
  const BitRow valid{bits.valid, columns.begin};
  const BitRow continues{bits.continues, columns.begin};
  int begin = valid.firstSet(columns.begin, columns.end);
  while (begin < columns.end) {
    const int end = continues.firstClear(begin, columns.end - 1) + 1;
    runs_.push_back({row, begin, end, static_cast<int>(runs_.size())});
    begin = valid.firstSet(end, columns.end);
  }
  joinRows(above_, here, {bits.touches, columns.begin});
  above_ = here;
  is_first_ = false;
}

void
PixelRuns::component(int u, int v, int image_width, std::vector<int>& indices)
{
  indices.clear();
  const auto seed = std::find_if(runs_.begin(), runs_.end(), [&](const Run& run) {
    return run.row == v && u >= run.begin && u < run.end;
  });
  if (seed == runs_.end())
    return;
  const int root = rootOf(static_cast<int>(seed - runs_.begin()));
  for (int i = 0; i < static_cast<int>(runs_.size()); ++i) {
    if (rootOf(i) != root)
      continue;
    const std::size_t size = indices.size();
    indices.resize(size + static_cast<std::size_t>(runs_[i].end - runs_[i].begin));
    int index = runs_[i].row * image_width + runs_[i].begin;
    for (std::size_t j = size; j < indices.size(); ++j)
      indices[j] = index++;
  }
}

} // namespace holdfast
