// Ranking of footholds: order, spacing, that nothing is lost, and that threads decide
// nothing.
#include "support/random.h"
#include "support/risk_map.h"

#include <holdfast/contact/foothold.h>
#include <holdfast/geometry/constants.h>

#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <stdexcept>

namespace holdfast { namespace {

using test::Random;
using test::roughGround;

constexpr double kRadius = 0.06;

Foot
smallFoot()
{
  return rectangularFoot(0.07, 0.04);
}

int
counted(const FootholdRanking& r)
{
  return static_cast<int>(r.footholds.size()) + r.unseen + r.without_support +
         r.not_facing + r.too_near + r.beyond_limit;
}

TEST(FootholdRanking, CountsEveryPatch)
{
  for (std::uint64_t run = 0; run < 5; ++run) {
    Random random(run);
    const PatchMap map = roughGround(8, kRadius, random);
    FootholdOptions options;
    options.max_footholds = 10;
    const FootholdRanking ranking = rankFootholds(map, smallFoot(), options);
    EXPECT_EQ(ranking.candidates, static_cast<int>(map.patches().size()));
    EXPECT_GT(ranking.candidates, 50);
    EXPECT_EQ(counted(ranking), ranking.candidates);
    EXPECT_LE(ranking.footholds.size(), 10u);
    EXPECT_GT(ranking.footholds.size(), 0u);
    EXPECT_GE(ranking.widest_support_m, kRadius);
  }
}

TEST(FootholdRanking, PutsTheBetterFirst)
{
  Random random;
  const PatchMap map = roughGround(8, kRadius, random);
  FootholdOptions options;
  options.spacing_m = 0.0;
  const auto footholds = rankFootholds(map, smallFoot(), options).footholds;
  ASSERT_GT(footholds.size(), 20u);
  for (std::size_t i = 1; i < footholds.size(); ++i) {
    const ContactQuality& a = *footholds[i - 1].risk.quality;
    const ContactQuality& b = *footholds[i].risk.quality;
    const double before = std::round(1e6 * a.risk.total);
    const double after = std::round(1e6 * b.risk.total);
    EXPECT_LE(before, after);
    if (before == after) {
      EXPECT_GE(a.contact_area_m2, b.contact_area_m2);
    }
  }
}

TEST(FootholdRanking, KeepsItsDistance)
{
  Random random;
  const PatchMap map = roughGround(8, kRadius, random);
  FootholdOptions options;
  options.spacing_m = 0.15;
  const FootholdRanking ranking = rankFootholds(map, smallFoot(), options);
  const auto& f = ranking.footholds;
  for (std::size_t i = 0; i < f.size(); ++i)
    for (std::size_t j = 0; j < i; ++j)
      EXPECT_GE((f[i].placement.point - f[j].placement.point).norm(), 0.15);
  EXPECT_GT(ranking.too_near, 0);
  // The best is never left out for another.
  options.spacing_m = 0.0;
  EXPECT_EQ(f.front().patch,
            rankFootholds(map, smallFoot(), options).footholds.front().patch);
}

TEST(FootholdRanking, IsThatOfTheContactItself)
{
  Random random;
  const PatchMap map = roughGround(5, kRadius, random);
  FootholdOptions options;
  options.spacing_m = 0.0;
  for (const Foothold& foothold : rankFootholds(map, smallFoot(), options).footholds) {
    const MapPatch* patch = map.find(foothold.patch);
    ASSERT_NE(patch, nullptr);
    const ContactRisk alone = contactRisk(
        contactSurfaceOf(map, *patch, surfacePriorOf(map, options.load_direction)),
        smallFoot(),
        foothold.placement);
    ASSERT_TRUE(alone.quality);
    EXPECT_NEAR(alone.quality->risk.total, foothold.risk.quality->risk.total, 1e-4);
    // No other yaw is better.
    Placement first = foothold.placement;
    for (const ContactRisk& other : contactRisks(
             contactSurfaceOf(map, *patch, surfacePriorOf(map, options.load_direction)),
             smallFoot(),
             first,
             options.yaws))
      if (other.quality) {
        EXPECT_GE(other.quality->risk.total, foothold.risk.quality->risk.total - 1e-4);
      }
  }
}

// Most yaws are left out by bounds alone: none of them was the best.
TEST(FootholdRanking, HasTheBestOfAllYaws)
{
  constexpr int kYaws = 16;
  for (std::uint64_t run = 0; run < 5; ++run) {
    Random random(run);
    const PatchMap map = roughGround(8, kRadius, random);
    const SurfacePrior prior = surfacePriorOf(map, -Eigen::Vector3d::UnitZ());
    for (const MapPatch& patch : map.patches()) {
      Foot foot = rectangularFoot(random.uniform(0.04, 0.09), 0.04);
      foot.ankle = random.uniform(0.0, 1.0) < 0.5 ? Ankle::Stiff : Ankle::Compliant;
      foot.tolerances.gap_m = std::pow(10.0, random.uniform(-4.0, -2.0));
      const ContactSurface surface = contactSurfaceOf(map, patch, prior);
      Placement placement;
      placement.point = *middleOfSupport(surface);
      const std::vector<ContactRisk> all =
          contactRisks(surface, foot, placement, kYaws);
      std::size_t best = 0;
      for (std::size_t i = 1; i < all.size(); ++i) {
        if (!all[i].quality || !all[best].quality) {
          const bool has_more = all[i].support_share > all[best].support_share;
          best = all[i].quality || (!all[best].quality && has_more) ? i : best;
          continue;
        }
        const ContactQuality &a = *all[i].quality, &b = *all[best].quality;
        const double more =
            std::round(1e6 * a.risk.total) - std::round(1e6 * b.risk.total);
        if (more < 0.0 || (more == 0.0 && a.contact_area_m2 > b.contact_area_m2))
          best = i;
      }
      const ContactRisk found = bestYaw(surface, foot, placement, kYaws);
      EXPECT_DOUBLE_EQ(placement.yaw, 2.0 * kPi * static_cast<double>(best) / kYaws);
      EXPECT_EQ(found.support_share, all[best].support_share);
      ASSERT_EQ(found.quality.has_value(), all[best].quality.has_value());
      if (found.quality) {
        EXPECT_EQ(found.quality->risk.total, all[best].quality->risk.total);
      }
    }
  }
}

TEST(FootholdRanking, IsTheSameForAnyNumberOfThreads)
{
  Random random;
  const PatchMap map = roughGround(10, kRadius, random);
  FootholdOptions options;
  const FootholdRanking one = rankFootholds(map, smallFoot(), options);
  for (const int threads : {2, 3, 0}) {
    options.threads = threads;
    const FootholdRanking many = rankFootholds(map, smallFoot(), options);
    ASSERT_EQ(many.footholds.size(), one.footholds.size());
    for (std::size_t i = 0; i < one.footholds.size(); ++i) {
      EXPECT_EQ(many.footholds[i].patch, one.footholds[i].patch);
      EXPECT_EQ(many.footholds[i].placement.yaw, one.footholds[i].placement.yaw);
      EXPECT_EQ(many.footholds[i].risk.quality->risk.total,
                one.footholds[i].risk.quality->risk.total);
    }
    EXPECT_EQ(many.too_near, one.too_near);
    EXPECT_EQ(many.without_support, one.without_support);
  }
}

TEST(FootholdRanking, SaysWhatHasNoFoothold)
{
  Random random;
  const PatchMap map = roughGround(5, kRadius, random);
  const int all = static_cast<int>(map.patches().size());
  const Foot large = rectangularFoot(0.3, 0.2);
  const FootholdRanking none = rankFootholds(map, large);
  EXPECT_EQ(none.without_support, all);
  EXPECT_TRUE(none.footholds.empty());
  EXPECT_LT(none.widest_support_m, soleReach(large));
  FootholdOptions from_below;
  from_below.load_direction = Eigen::Vector3d::UnitZ();
  EXPECT_EQ(rankFootholds(map, smallFoot(), from_below).not_facing, all);
  EXPECT_EQ(rankFootholds(PatchMap(), smallFoot()).candidates, 0);

  PatchMap::Snapshot blind = map.snapshot();
  for (MapPatch& patch : blind.patches)
    patch.support = SupportGrid();
  EXPECT_EQ(rankFootholds(PatchMap(blind), smallFoot()).unseen, all);
}

TEST(FootholdRanking, RefusesWhatMakesNoSense)
{
  const PatchMap map;
  const auto with = [](auto change) {
    FootholdOptions options;
    change(options);
    return options;
  };
  for (const FootholdOptions& options :
       {with([](auto& o) { o.load_direction.setZero(); }),
        with([](auto& o) { o.load_direction.x() = NAN; }),
        with([](auto& o) { o.yaws = 0; }),
        with([](auto& o) { o.spacing_m = -0.1; }),
        with([](auto& o) { o.spacing_m = NAN; }),
        with([](auto& o) { o.max_footholds = 0; }),
        with([](auto& o) { o.threads = -1; })}) {
    EXPECT_NE(validityError(options), "");
    EXPECT_THROW(rankFootholds(map, smallFoot(), options), std::invalid_argument);
  }
  Foot foot = smallFoot();
  foot.sole.resize(2);
  EXPECT_THROW(rankFootholds(map, foot), std::invalid_argument);
}

}} // namespace holdfast
