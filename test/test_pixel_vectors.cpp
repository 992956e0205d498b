// What several pixels at a time give is what they give one by one.
#include "pcl/pixel_runs.h"
#include "pcl/pixel_vectors.h"

#include "support/random.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <set>
#include <vector>

namespace holdfast { namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
constexpr int kWidth = 90, kHeight = 40;

RaySamples
randomSamples(test::Random& random, int n, double curvature)
{
  RaySamples samples;
  for (int i = 0; i < n; ++i) {
    const double s = random.uniform(-0.05, 0.05), t = random.uniform(-0.05, 0.05);
    const double bent = curvature * (s * s + 0.4 * s * t - 0.7 * t * t);
    samples.add(s, t, 0.8 + 0.3 * s - 0.5 * t + bent + 1e-3 * random.normal());
  }
  return samples;
}

TEST(PixelVectors, SumsOfSamples)
{
  test::Random random;
  for (const int n : {1, 5, 8, 37, 96}) {
    const RaySamples samples = randomSamples(random, n, 10.0);
    const double scale = 0.03;
    const SampleSums plane = sumSamples(samples, 1, scale);
    const SampleSums sums = sumSamples(samples, 2, scale);
    for (int b = 0; b <= 4; ++b)
      for (int a = 0; a + b <= 4; ++a) {
        double power = 0.0, with_rho = 0.0, magnitude = 0.0;
        for (int k = 0; k < n; ++k) {
          const double term =
              std::pow(samples.s[k] / scale, a) * std::pow(samples.t[k] / scale, b);
          power += term;
          magnitude += std::abs(term);
          with_rho += term * (samples.inverse_depth[k] - samples.inverse_depth[0]);
        }
        // Rounding of a sum of n terms.
        const double tolerance = 1e-15 * n * magnitude;
        const auto i = static_cast<std::size_t>(monomialIndex(a, b));
        EXPECT_NEAR(sums.powers[i], power, tolerance) << a << b;
        if (a + b <= 2) {
          EXPECT_NEAR(plane.powers[i], power, tolerance) << a << b;
          EXPECT_NEAR(sums.with_rho[i], with_rho, tolerance) << a << b;
        }
        if (a + b <= 1) {
          EXPECT_NEAR(plane.with_rho[i], with_rho, tolerance) << a << b;
        }
      }
  }
}

ReferenceSurface
randomSurface(test::Random& random, bool bends)
{
  ReferenceSurface surface({random.uniform(-0.4, 0.4), random.uniform(-0.3, 0.3)}, 1.2);
  const RaySamples samples = randomSamples(random, 60, bends ? 60.0 : 0.0);
  EXPECT_TRUE(bends ? surface.fitQuadric(samples, 1e-3) : surface.fitPlane(samples));
  EXPECT_EQ(surface.isPlane(), !bends);
  return surface;
}

struct DiscCase {
  explicit DiscCase(test::Random& random, bool bends)
  : disc(randomSurface(random, bends), random.uniform(0.01, 0.08))
  , seed{random.integer(20, 70), random.integer(5, 35), 400.0, 420.0}
  , window{{random.integer(0, 15), random.integer(75, kWidth)},
           {random.integer(0, 4), random.integer(36, kHeight)}}
  , chords(static_cast<std::size_t>(window.rows.end - window.rows.begin))
  {}

  double s(int u) const
  {
    return (u - seed.u) / seed.fx;
  }

  double t(int v) const
  {
    return (v - seed.v) / seed.fy;
  }

  LateralDisc disc;
  SeedPixel seed;
  PixelWindow window;
  std::vector<PixelRange> chords;
};

// By what rounding can move the edge of a disc: single precision where surfaces bend.
constexpr double kEdge = 1e-5;

TEST(PixelVectors, ChordsHoldThePixelsOfADiscOnAPlane)
{
  for (std::uint64_t i = 0; i < 50; ++i) {
    test::Random random(i);
    DiscCase c(random, false);
    discChords(c.disc, c.seed, c.window, c.chords.data());
    for (int v = c.window.rows.begin; v < c.window.rows.end; ++v) {
      const PixelRange& chord =
          c.chords[static_cast<std::size_t>(v - c.window.rows.begin)];
      for (int u = c.window.columns.begin; u < c.window.columns.end; ++u) {
        const double rho = c.disc.surface().inverseDepth(c.s(u), c.t(v));
        const double excess = c.disc.excess(c.s(u), c.t(v), rho);
        if (std::abs(excess) > 1e-12) {
          EXPECT_EQ(u >= chord.begin && u < chord.end, excess < 0.0) << u << ' ' << v;
        }
      }
    }
  }
}

TEST(PixelVectors, ChordsOfAPlaneSeenEdgeOnAreEndless)
{
  // Within the radius it passes the camera by.
  test::Random random;
  ReferenceSurface surface({0.0, 0.0}, 1.0);
  RaySamples samples;
  for (int i = 0; i < 20; ++i) {
    const double s = random.uniform(-0.02, 0.02), t = random.uniform(-0.02, 0.02);
    samples.add(s, t, 1.0 + 20.0 * s);
  }
  ASSERT_TRUE(surface.fitPlane(samples));
  const LateralDisc disc(surface, 1.1);
  ASSERT_LE(disc.onTangentPlane().A, 0.0);
  const PixelWindow window{{3, 60}, {2, 9}};
  std::vector<PixelRange> chords(7);
  discChords(disc, {30, 5, 400.0, 400.0}, window, chords.data());
  for (const PixelRange& chord : chords) {
    EXPECT_EQ(chord.begin, 3);
    EXPECT_EQ(chord.end, 60);
  }
}

void
expectDepartures(test::Random& random, DiscCase& c)
{
  std::vector<float> depth(kWidth * kHeight + kRowPadding, kNaN);
  const float gate = 0.01F;
  const auto at = [](int u, int v) { return static_cast<std::size_t>(v * kWidth + u); };
  for (int v = 0; v < kHeight; ++v)
    for (int u = 0; u < kWidth; ++u) {
      const double rho = c.disc.surface().inverseDepth(c.s(u), c.t(v));
      if (random.uniform(0.0, 1.0) < 0.9)
        depth[at(u, v)] = static_cast<float>(1.0 / (rho + 0.007 * random.normal()));
    }
  std::vector<float> departures(depth.size());
  discChords(c.disc, c.seed, c.window, c.chords.data());
  surfaceDepartures({c.disc, c.seed, {depth.data(), kWidth}, gate},
                    {c.window.rows, c.chords.data()},
                    departures.data(),
                    kWidth);
  for (int v = c.window.rows.begin; v < c.window.rows.end; ++v) {
    const PixelRange& chord =
        c.chords[static_cast<std::size_t>(v - c.window.rows.begin)];
    for (int u = chord.begin; u < chord.end; ++u) {
      const double rho = c.disc.surface().inverseDepth(c.s(u), c.t(v));
      const double departure = 1.0 / depth[at(u, v)] - rho;
      const double excess = c.disc.excess(c.s(u), c.t(v), rho);
      const bool is_near_a_limit =
          std::abs(std::abs(departure) - gate) < 1e-6 ||
          (!c.disc.surface().isPlane() && std::abs(excess) < kEdge * rho * rho);
      if (is_near_a_limit)
        continue;
      const bool belongs =
          std::abs(departure) < gate && (c.disc.surface().isPlane() || excess < 0.0);
      EXPECT_EQ(!std::isnan(departures[at(u, v)]), belongs) << u << ' ' << v;
      if (belongs) {
        EXPECT_NEAR(departures[at(u, v)], departure, 1e-6) << u << ' ' << v;
      }
    }
  }
}

TEST(PixelVectors, DeparturesFromPlanesAndQuadrics)
{
  for (std::uint64_t i = 0; i < 40; ++i) {
    test::Random random(i);
    DiscCase c(random, i % 2 == 1);
    expectDepartures(random, c);
  }
}

TEST(PixelVectors, NeighborsOfRowsOfEveryLength)
{
  test::Random random;
  for (int count = 1; count < 200; count += random.integer(1, 9)) {
    std::vector<float> row, above;
    for (int i = 0; i < count + kRowPadding; ++i) {
      row.push_back(random.integer(0, 9) == 0 ? kNaN : float(random.normal()));
      above.push_back(random.integer(0, 9) == 0 ? kNaN : float(random.normal()));
    }
    const auto words = static_cast<std::size_t>((count + kWordBits - 1) / kWordBits);
    std::vector<std::uint64_t> bits(3 * words, ~std::uint64_t{0});
    const RowBits found{&bits[0], &bits[words], &bits[2 * words]};
    compareNeighbors(row.data(), above.data(), count, {1.0F, 0.7F}, found);
    for (int i = 0; i < static_cast<int>(words) * kWordBits; ++i) {
      const auto at = static_cast<std::size_t>(i);
      const auto bit = [i](const std::uint64_t* word) {
        return ((word[i / kWordBits] >> (i % kWordBits)) & 1) != 0;
      };
      const bool within = i < count;
      EXPECT_EQ(bit(found.valid), within && !std::isnan(row[at])) << i;
      EXPECT_EQ(bit(found.continues),
                i + 1 < count && std::abs(row[at + 1] - row[at]) < 1.0F)
          << i;
      EXPECT_EQ(bit(found.touches), within && std::abs(row[at] - above[at]) < 0.7F)
          << i;
    }
  }
}

// The pixels that a flood from the seed reaches.
std::vector<int>
flooded(const std::vector<float>& values, const PixelJump& jump, int seed)
{
  std::set<int> reached;
  std::vector<int> ends{seed};
  if (std::isnan(values[static_cast<std::size_t>(seed)]))
    return {};
  while (!ends.empty()) {
    const int from = ends.back();
    ends.pop_back();
    if (!reached.insert(from).second)
      continue;
    const auto visit = [&](int to, bool inside, float limit) {
      if (inside && std::abs(values[static_cast<std::size_t>(to)] -
                             values[static_cast<std::size_t>(from)]) < limit)
        ends.push_back(to);
    };
    visit(from - 1, from % kWidth > 0, jump.in_row);
    visit(from + 1, from % kWidth < kWidth - 1, jump.in_row);
    visit(from - kWidth, from >= kWidth, jump.across_rows);
    visit(from + kWidth, from < kWidth * (kHeight - 1), jump.across_rows);
  }
  return {reached.begin(), reached.end()};
}

TEST(PixelVectors, ComponentsAreWhatAFloodReaches)
{
  RunMemory memory;
  for (std::uint64_t i = 0; i < 40; ++i) {
    test::Random random(i);
    std::vector<float> values(kWidth * kHeight + kRowPadding, kNaN);
    for (int j = 0; j < kWidth * kHeight; ++j)
      if (random.uniform(0.0, 1.0) < 0.85)
        values[static_cast<std::size_t>(j)] = static_cast<float>(random.normal());
    const PixelJump jump{1.2F, 0.5F};
    PixelRuns runs({values.data(), kWidth}, jump, memory);
    for (int v = 0; v < kHeight; ++v)
      runs.addRow(v, {0, kWidth});
    const int seed = random.integer(0, kWidth * kHeight - 1);
    std::vector<int> found;
    runs.component(seed % kWidth, seed / kWidth, kWidth, found);
    EXPECT_EQ(found, flooded(values, jump, seed));
  }
}

}} // namespace holdfast
