// The passes over pixels for every instruction set, chosen at run time (Highway).
#include "pixel_vectors.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#ifdef HOLDFAST_HAVE_HIGHWAY

#include "fit/vector_targets.inl"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pcl/pixel_vectors.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace holdfast { namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

constexpr hn::ScalableTag<float> kFloats;
constexpr hn::ScalableTag<double> kDoubles;
constexpr int kPixels = static_cast<int>(hn::MaxLanes(kFloats));
constexpr int kSamples = static_cast<int>(hn::MaxLanes(kDoubles));
static_assert(kPixels <= kRowPadding && RaySamples::kMost % kSamples == 0);

using Floats = hn::Vec<hn::ScalableTag<float>>;
using Doubles = hn::Vec<hn::ScalableTag<double>>;

void
dispatchedChords(const LateralDisc& disc,
                 const SeedPixel& seed,
                 const PixelWindow& window,
                 PixelRange* chords)
{
  const auto set = [](double x) { return hn::Set(kDoubles, x); };
  const auto& [A, B, C] = disc.onTangentPlane();
  const Doubles zero = hn::Zero(kDoubles), focal = set(seed.fx), centre = set(seed.u);
  const Doubles least = set(window.columns.begin), most = set(window.columns.end);
  const Doubles one = set(1.0), per_A = set(1.0 / A);
  const auto column = [&](Doubles root_less_b, Doubles lowest, Doubles highest) {
    const Doubles u = hn::MulAdd(hn::Mul(root_less_b, per_A), focal, centre);
    return hn::Min(hn::Max(u, lowest), highest);
  };
  const int count = window.rows.end - window.rows.begin;
  for (int i = 0; i < count; i += kSamples) {
    const Doubles row = hn::Add(hn::Iota(kDoubles, i), set(window.rows.begin - seed.v));
    const Doubles t = hn::Div(row, set(seed.fy));
    const Doubles b = hn::MulAdd(set(B[1]), t, set(B[0]));
    const Doubles c = hn::MulAdd(hn::MulAdd(set(C[2]), t, set(C[1])), t, set(C[0]));
    const Doubles discriminant = hn::NegMulAdd(set(A), c, hn::Mul(b, b));
    const Doubles root = hn::Sqrt(hn::Max(discriminant, zero));
    const auto none = hn::Lt(discriminant, zero);
    double begin[kSamples], end[kSamples];
    const Doubles low = hn::Ceil(column(hn::Neg(hn::Add(root, b)), least, most));
    const Doubles high =
        hn::Floor(column(hn::Sub(root, b), hn::Sub(least, one), hn::Sub(most, one)));
    hn::StoreU(hn::IfThenElse(none, least, low), kDoubles, begin);
    hn::StoreU(hn::IfThenElse(none, least, hn::Max(low, hn::Add(high, one))),
               kDoubles,
               end);
    for (int j = 0; j < kSamples && i + j < count; ++j)
      chords[i + j] = {static_cast<int>(begin[j]), static_cast<int>(end[j])};
  }
}

// What the rows of a disc have in common.
class RowOfDisc {
public:
  HWY_INLINE RowOfDisc(const LateralDisc& disc, const SeedPixel& seed, float gate)
  : h_(disc.surface().coefficients())
  , is_plane_(disc.surface().isPlane())
  , x_(static_cast<float>(disc.surface().seedRay().x()))
  , y_(disc.surface().seedRay().y())
  , fy_(seed.fy)
  , pitch_(hn::Set(kFloats, static_cast<float>(1.0 / seed.fx)))
  , gate_(hn::Set(kFloats, gate))
  , squared_radius_(set(disc.lateralExcess().squared_radius))
  {
    for (std::size_t i = 0; i < 3; ++i) {
      point_[i] = set(disc.lateralExcess().point[i]);
      normal_[i] = set(disc.lateralExcess().normal[i]);
    }
  }

  // Of pixels from `column` of the seed's on, `row` below it.
  HWY_INLINE void departures(int column,
                             int row,
                             int count,
                             const float* HWY_RESTRICT depth,
                             float* HWY_RESTRICT out) const
  {
    const Floats none = set(std::numeric_limits<double>::quiet_NaN());
    const Floats one = set(1.0), zero = hn::Zero(kFloats);
    const double t = row / fy_;
    const Floats h0 = set(h_[0] + t * (h_[2] + h_[5] * t));
    const Floats h1 = set(h_[1] + h_[4] * t), h2 = set(h_[3]), y = set(y_ + t);
    for (int i = 0; i < count; i += kPixels) {
      const Floats s =
          hn::Mul(pitch_, hn::Iota(kFloats, static_cast<float>(column + i)));
      const Floats rho = hn::MulAdd(hn::MulAdd(h2, s, h1), s, h0);
      const Floats departure =
          hn::Sub(hn::Div(one, hn::LoadU(kFloats, depth + i)), rho);
      auto belongs = hn::And(hn::Le(hn::Abs(departure), gate_), hn::Lt(zero, rho));
      if (!is_plane_)
        belongs = hn::And(belongs, hn::Le(excess(hn::Add(set(x_), s), y, rho), zero));
      hn::StoreU(hn::IfThenElse(belongs, departure, none), kFloats, out + i);
    }
  }

private:
  HWY_INLINE static Floats set(double x)
  {
    return hn::Set(kFloats, static_cast<float>(x));
  }

  // LateralExcess.
  HWY_INLINE Floats excess(Floats x, Floats y, Floats rho) const
  {
    const Floats gx = hn::NegMulAdd(rho, point_[0], x);
    const Floats gy = hn::NegMulAdd(rho, point_[1], y);
    const Floats gz = hn::NegMulAdd(rho, point_[2], set(1.0));
    const Floats off =
        hn::MulAdd(normal_[0], gx, hn::MulAdd(normal_[1], gy, hn::Mul(normal_[2], gz)));
    const Floats squared = hn::MulAdd(gx, gx, hn::MulAdd(gy, gy, hn::Mul(gz, gz)));
    return hn::NegMulAdd(hn::Mul(squared_radius_, rho),
                         rho,
                         hn::NegMulAdd(off, off, squared));
  }

  const std::array<double, 6>& h_;
  bool is_plane_;
  float x_;
  double y_, fy_;
  Floats pitch_, gate_, squared_radius_, point_[3], normal_[3];
};

void
dispatchedDepartures(const DiscOverPixels& over,
                     const PixelChords& chords,
                     float* departures,
                     std::ptrdiff_t stride)
{
  const RowOfDisc row(over.disc, over.seed, over.gate);
  const PixelRange* chord = chords.columns;
  for (int v = chords.rows.begin; v < chords.rows.end; ++v, ++chord)
    row.departures(chord->begin - over.seed.u,
                   v - over.seed.v,
                   chord->end - chord->begin,
                   over.depth.row(v) + chord->begin,
                   departures + v * stride + chord->begin);
}

template <typename Mask>
HWY_INLINE std::uint64_t
bitsOf(Mask mask)
{
  std::uint8_t bytes[8] = {};
  hn::StoreMaskBits(kFloats, mask, bytes);
  std::uint64_t bits = 0;
  std::memcpy(&bits, bytes, sizeof(bits));
  return bits;
}

void
dispatchedNeighbors(const float* HWY_RESTRICT row,
                    const float* HWY_RESTRICT above,
                    int count,
                    const PixelJump& jump,
                    const RowBits& bits)
{
  const Floats in_row = hn::Set(kFloats, jump.in_row);
  const Floats across = hn::Set(kFloats, jump.across_rows);
  for (int first = 0, word = 0; first < count; first += kWordBits, ++word) {
    std::uint64_t valid = 0, continues = 0, touches = 0;
    const int end = count - first < kWordBits ? count - first : kWordBits;
    for (int i = 0; i < end; i += kPixels) {
      const Floats here = hn::LoadU(kFloats, row + first + i);
      const Floats next = hn::LoadU(kFloats, row + first + i + 1);
      const Floats over = hn::LoadU(kFloats, above + first + i);
      valid |= bitsOf(hn::Eq(here, here)) << i;
      continues |= bitsOf(hn::Lt(hn::Abs(hn::Sub(next, here)), in_row)) << i;
      touches |= bitsOf(hn::Lt(hn::Abs(hn::Sub(here, over)), across)) << i;
    }
    // What lies beyond the last pixel is not of the row.
    const std::uint64_t within = ~std::uint64_t{0} >> (kWordBits - end);
    const bool is_last = first + end == count;
    bits.valid[word] = valid & within;
    bits.continues[word] = continues & (is_last ? within >> 1 : within);
    bits.touches[word] = touches & within;
  }
}

// Products of samples' slopes and inverse depths, added up.
template <int order>
struct LaneSums {
  static constexpr int kPowers = numberOfMonomials(2 * order);
  static constexpr int kWithRho = numberOfMonomials(order);
  Doubles powers[kPowers], with_rho[kWithRho];

  HWY_INLINE LaneSums()
  {
    for (Doubles& sum : powers)
      sum = hn::Zero(kDoubles);
    for (Doubles& sum : with_rho)
      sum = hn::Zero(kDoubles);
  }

  HWY_INLINE void add(Doubles s, Doubles t, Doubles rho)
  {
    constexpr int n = 2 * order + 1;
    Doubles power[n] = {hn::Set(kDoubles, 1.0)}; // of s, then each times t^b
    for (int a = 1; a < n; ++a)
      power[a] = hn::Mul(power[a - 1], s);
    for (int b = 0; b < n; ++b)
      for (int a = 0; a + b < n; ++a) {
        const int i = monomialIndex(a, b);
        powers[i] = hn::Add(powers[i], power[a]);
        if (a + b <= order)
          with_rho[i] = hn::MulAdd(rho, power[a], with_rho[i]);
        power[a] = hn::Mul(power[a], t);
      }
  }
};

template <int order>
HWY_INLINE void
sumsOfOrder(const RaySamples& samples, double scale, SampleSums& sums)
{
  LaneSums<order> lanes;
  const Doubles unit = hn::Set(kDoubles, 1.0 / scale);
  const Doubles origin = hn::Set(kDoubles, samples.inverse_depth[0]);
  for (int i = 0; i < samples.size; i += kSamples) {
    // What fills the last vector adds nothing but to the number of samples.
    const auto within =
        hn::FirstN(kDoubles, static_cast<std::size_t>(samples.size - i));
    const auto some = [&](Doubles x) { return hn::IfThenElseZero(within, x); };
    lanes.add(some(hn::Mul(hn::LoadU(kDoubles, samples.s + i), unit)),
              some(hn::Mul(hn::LoadU(kDoubles, samples.t + i), unit)),
              some(hn::Sub(hn::LoadU(kDoubles, samples.inverse_depth + i), origin)));
  }
  const auto total = [](Doubles x) { return hn::GetLane(hn::SumOfLanes(kDoubles, x)); };
  std::transform(lanes.powers,
                 lanes.powers + lanes.kPowers,
                 sums.powers.begin(),
                 total);
  std::transform(lanes.with_rho,
                 lanes.with_rho + lanes.kWithRho,
                 sums.with_rho.begin(),
                 total);
  sums.powers[0] = samples.size;
}

void
dispatchedSums(const RaySamples& samples, int order, double scale, SampleSums& sums)
{
  if (order == 1)
    sumsOfOrder<1>(samples, scale, sums);
  else
    sumsOfOrder<2>(samples, scale, sums);
}

}} // namespace holdfast::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace holdfast {

HWY_EXPORT(dispatchedChords);
HWY_EXPORT(dispatchedDepartures);
HWY_EXPORT(dispatchedNeighbors);
HWY_EXPORT(dispatchedSums);

void
discChords(const LateralDisc& disc,
           const SeedPixel& seed,
           const PixelWindow& window,
           PixelRange* chords)
{
  if (disc.onTangentPlane().A > 0.0)
    HWY_DYNAMIC_DISPATCH(dispatchedChords)(disc, seed, window, chords);
  else
    std::fill_n(chords, window.rows.end - window.rows.begin, window.columns);
}

void
surfaceDepartures(const DiscOverPixels& over,
                  const PixelChords& chords,
                  float* departures,
                  std::ptrdiff_t stride)
{
  HWY_DYNAMIC_DISPATCH(dispatchedDepartures)(over, chords, departures, stride);
}

void
compareNeighbors(const float* row,
                 const float* above,
                 int count,
                 const PixelJump& jump,
                 const RowBits& bits)
{
  HWY_DYNAMIC_DISPATCH(dispatchedNeighbors)(row, above, count, jump, bits);
}

SampleSums
sumSamples(const RaySamples& samples, int order, double scale)
{
  SampleSums sums{};
  HWY_DYNAMIC_DISPATCH(dispatchedSums)(samples, order, scale, sums);
  return sums;
}

} // namespace holdfast
#endif

#else // one by one

namespace holdfast {
namespace {

PixelRange
chordOfRow(const LateralDisc& disc, const SeedPixel& seed, int v, const PixelRange& all)
{
  const auto& [A, B, C] = disc.onTangentPlane();
  if (!(A > 0.0))
    return all;
  const double t = (v - seed.v) / seed.fy;
  const double b = B[0] + B[1] * t, c = C[0] + t * (C[1] + t * C[2]);
  const double discriminant = b * b - A * c;
  if (discriminant < 0.0)
    return {all.begin, all.begin};
  const double least = all.begin, most = all.end, root = std::sqrt(discriminant);
  const double low = (-b - root) / A * seed.fx + seed.u;
  const double high = (-b + root) / A * seed.fx + seed.u;
  const int begin = static_cast<int>(std::ceil(std::clamp(low, least, most)));
  const int last = static_cast<int>(std::floor(std::clamp(high, least - 1, most - 1)));
  return {begin, std::max(begin, last + 1)};
}

} // namespace

void
discChords(const LateralDisc& disc,
           const SeedPixel& seed,
           const PixelWindow& window,
           PixelRange* chords)
{
  for (int v = window.rows.begin; v < window.rows.end; ++v, ++chords)
    *chords = chordOfRow(disc, seed, v, window.columns);
}

void
surfaceDepartures(const DiscOverPixels& over,
                  const PixelChords& chords,
                  float* departures,
                  std::ptrdiff_t stride)
{
  const ReferenceSurface& surface = over.disc.surface();
  const PixelRange* chord = chords.columns;
  for (int v = chords.rows.begin; v < chords.rows.end; ++v, ++chord) {
    const double t = (v - over.seed.v) / over.seed.fy;
    for (int u = chord->begin; u < chord->end; ++u) {
      const double s = (u - over.seed.u) / over.seed.fx;
      const double rho = surface.inverseDepth(s, t);
      const auto departure = static_cast<float>(1.0 / over.depth.row(v)[u] - rho);
      const bool belongs = std::abs(departure) <= over.gate && rho > 0.0 &&
                           (surface.isPlane() || over.disc.excess(s, t, rho) <= 0.0);
      departures[v * stride + u] =
          belongs ? departure : std::numeric_limits<float>::quiet_NaN();
    }
  }
}

void
compareNeighbors(const float* row,
                 const float* above,
                 int count,
                 const PixelJump& jump,
                 const RowBits& bits)
{
  for (int i = 0; i < count; ++i) {
    const int word = i / kWordBits;
    const std::uint64_t bit = std::uint64_t{1} << (i % kWordBits);
    if (i % kWordBits == 0)
      bits.valid[word] = bits.continues[word] = bits.touches[word] = 0;
    if (row[i] == row[i])
      bits.valid[word] |= bit;
    if (i + 1 < count && std::abs(row[i + 1] - row[i]) < jump.in_row)
      bits.continues[word] |= bit;
    if (std::abs(row[i] - above[i]) < jump.across_rows)
      bits.touches[word] |= bit;
  }
}

SampleSums
sumSamples(const RaySamples& samples, int order, double scale)
{
  SampleSums sums{};
  for (int k = 0; k < samples.size; ++k) {
    const double s = samples.s[k] / scale, t = samples.t[k] / scale;
    const double rho = samples.inverse_depth[k] - samples.inverse_depth[0];
    double row = 1.0; // t^b
    for (int b = 0; b <= 2 * order; ++b, row *= t) {
      double power = row;
      for (int a = 0; a + b <= 2 * order; ++a, power *= s) {
        const auto i = static_cast<std::size_t>(monomialIndex(a, b));
        sums.powers[i] += power;
        if (a + b <= order)
          sums.with_rho[i] += rho * power;
      }
    }
  }
  return sums;
}

} // namespace holdfast

#endif
