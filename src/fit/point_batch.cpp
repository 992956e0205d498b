#include "surface_fit.h"

#include "parallel/thread_memory.h"

#include <holdfast/fit/point_batch.h>
#include <holdfast/geometry/gaussian.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <new>
#include <stdexcept>
#include <vector>

namespace holdfast {
namespace {

// One cache line, and the widest vectors.
constexpr std::size_t kAlignment = 64;
constexpr int kDoublesPerLine = kAlignment / sizeof(double);

int
roundedUp(int n)
{
  return (n + PointBatch::kLaneMultiple - 1) / PointBatch::kLaneMultiple *
         PointBatch::kLaneMultiple;
}

} // namespace

void
PointBatch::Deleter::operator()(double* p) const
{
  std::free(p);
}

void
PointBatch::clear(const Eigen::Vector3d& origin)
{
  clear(origin, Eigen::Vector3d::Zero());
}

void
PointBatch::clear(const Eigen::Vector3d& origin, const Eigen::Vector3d& viewpoint)
{
  size_ = 0;
  origin_ = origin;
  setViewpoint(viewpoint);
  pattern_.reset();
}

void
PointBatch::setViewpoint(const Eigen::Vector3d& viewpoint)
{
  if (!viewpoint.allFinite())
    throw std::invalid_argument("viewpoint must be finite");
  viewpoint_ = viewpoint;
}

void
PointBatch::reserve(int n)
{
  if (n <= capacity_)
    return;
  // An odd number of cache lines: at a power of two, all channels of a point would
  // compete for one set of the cache.
  static_assert(kLaneMultiple % (2 * kDoublesPerLine) == 0);
  const int capacity = roundedUp(n) + kDoublesPerLine;
  const std::size_t bytes =
      sizeof(double) * kChannels * static_cast<std::size_t>(capacity);
  std::unique_ptr<double[], Deleter> data(
      static_cast<double*>(std::aligned_alloc(kAlignment, bytes)));
  if (!data)
    throw std::bad_alloc();
  for (int c = 0; c < kChannels; ++c)
    std::copy_n(data_.get() + static_cast<std::ptrdiff_t>(c) * capacity_,
                size_,
                data.get() + static_cast<std::ptrdiff_t>(c) * capacity);
  data_ = std::move(data);
  capacity_ = capacity;
}

void
PointBatch::resize(int n)
{
  if (n > capacity_)
    reserve(std::max(n, 2 * capacity_));
  if (n > size_)
    std::fill(channel(W) + size_, channel(W) + n, 1.0);
  size_ = n;
}

void
PointBatch::add(const Eigen::Vector3d& point, const Eigen::Matrix3d& covariance)
{
  const int i = size_;
  resize(i + 1);
  for (int k = 0; k < 3; ++k)
    channel(static_cast<Channel>(X + k))[i] = point[k] - origin_[k];
  channel(SXX)[i] = covariance(0, 0);
  channel(SXY)[i] = covariance(0, 1);
  channel(SXZ)[i] = covariance(0, 2);
  channel(SYY)[i] = covariance(1, 1);
  channel(SYZ)[i] = covariance(1, 2);
  channel(SZZ)[i] = covariance(2, 2);
}

namespace {

bool
hasFinitePattern(const PointBatch& batch, int i)
{
  double sum = 0.0;
  for (int c = PointBatch::U; c <= PointBatch::EZ; ++c)
    sum += batch.channel(static_cast<PointBatch::Channel>(c))[i];
  return std::isfinite(sum);
}

bool
isValid(const PointBatch& batch, int i)
{
  return (batch.pattern() == nullptr || hasFinitePattern(batch, i)) &&
         (batch.point(i) - batch.origin()).allFinite() &&
         isPositiveSemiDefinite(batch.covariance(i));
}

double
traceOf(const PointBatch& batch, int i)
{
  return batch.channel(PointBatch::SXX)[i] + batch.channel(PointBatch::SYY)[i] +
         batch.channel(PointBatch::SZZ)[i];
}

// True when no trace can be too large beside the median, as none is beside the
// smallest: nearly always. In lanes, since one running minimum waits for itself.
bool
tracesAreAlike(const PointBatch& batch)
{
  constexpr int kLanes = PointBatch::kLaneMultiple;
  if (batch.size() == 0)
    return true;
  double smallest[kLanes], largest[kLanes];
  std::fill_n(smallest, kLanes, traceOf(batch, 0));
  std::fill_n(largest, kLanes, traceOf(batch, 0));
  const auto compare = [&](int lane, double trace) {
    smallest[lane] = trace < smallest[lane] ? trace : smallest[lane];
    largest[lane] = trace > largest[lane] ? trace : largest[lane];
  };
  int i = 0;
  for (; i + kLanes <= batch.size(); i += kLanes)
    for (int lane = 0; lane < kLanes; ++lane)
      compare(lane, traceOf(batch, i + lane));
  for (; i < batch.size(); ++i)
    compare(0, traceOf(batch, i));
  return *std::max_element(largest, largest + kLanes) <=
         kUninformativeTraceRatio * *std::min_element(smallest, smallest + kLanes);
}

} // namespace

int
PointBatch::removeInvalid()
{
  pad();
  kernel::Points points = kernelPoints(*this);
  const kernel::PatternPoints shared = kernelPattern(*this);
  if (pattern_)
    points.pattern = &shared;
  const int start = std::min(size_, kernel::countLeadingValid(points));
  int kept = start;
  for (int i = start; i < size_; ++i) {
    if (!isValid(*this, i))
      continue;
    movePoint(i, kept++);
  }
  const int removed = size_ - kept;
  size_ = kept;
  return removed;
}

void
PointBatch::movePoint(int from, int to)
{
  if (from != to)
    for (int c = 0; c < kChannels; ++c)
      channel(static_cast<Channel>(c))[to] = channel(static_cast<Channel>(c))[from];
}

int
PointBatch::removeUninformative()
{
  if (tracesAreAlike(*this))
    return 0;
  // Kept between neighbourhoods: no allocation once it has seen the largest.
  auto& traces = threadMemory<std::vector<double>, struct Traces>();
  traces.resize(static_cast<std::size_t>(size_));
  for (int i = 0; i < size_; ++i)
    traces[static_cast<std::size_t>(i)] = traceOf(*this, i);
  // The lower median: at least half of the points stay, and those that go carry less
  // than a hundredth of the information of those.
  const auto middle = traces.begin() + (size_ - 1) / 2;
  std::nth_element(traces.begin(), middle, traces.end());
  const double largest = kUninformativeTraceRatio * *middle;
  int kept = 0;
  for (int i = 0; i < size_; ++i)
    if (traceOf(*this, i) <= largest)
      movePoint(i, kept++);
  const int removed = size_ - kept;
  size_ = kept;
  return removed;
}

void
PointBatch::applyFloor(double sigma_floor_m)
{
  const double floor = sigma_floor_m * sigma_floor_m;
  double *xx = channel(SXX), *yy = channel(SYY), *zz = channel(SZZ);
  for (int i = 0; i < size_; ++i) {
    const double raise = xx[i] + yy[i] + zz[i] < floor ? floor : 0.0;
    xx[i] += raise;
    yy[i] += raise;
    zz[i] += raise;
  }
}

void
PointBatch::pad()
{
  reserve(roundedUp(size_));
  const int padded = paddedSize();
  for (int c = 0; c <= W && size_ > 0; ++c) {
    double* values = channel(static_cast<Channel>(c));
    // Copies of a point stay within range of the surface; no covariance, no weight.
    std::fill(values + size_, values + padded, c < SXX ? values[size_ - 1] : 0.0);
  }
  for (int c = U; c <= EXTRA && pattern_ && size_ > 0; ++c) {
    double* values = channel(static_cast<Channel>(c));
    std::fill(values + size_, values + padded, c < EX ? values[size_ - 1] : 0.0);
  }
}

int
PointBatch::paddedSize() const
{
  return roundedUp(size_);
}

Eigen::Vector3d
PointBatch::point(int i) const
{
  return origin_ + Eigen::Vector3d(channel(X)[i], channel(Y)[i], channel(Z)[i]);
}

Eigen::Matrix3d
PointBatch::covariance(int i) const
{
  Eigen::Matrix3d S;
  S << channel(SXX)[i], channel(SXY)[i], channel(SXZ)[i], channel(SXY)[i],
      channel(SYY)[i], channel(SYZ)[i], channel(SXZ)[i], channel(SYZ)[i],
      channel(SZZ)[i];
  return S;
}

} // namespace holdfast
