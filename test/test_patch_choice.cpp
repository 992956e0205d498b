// Which patches are given where not all are wanted.
#include "support/random.h"

#include "pcl/patch_choice.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace holdfast { namespace {

using test::Random;

ExtractedPatch
patchAt(const Eigen::Vector3d& centre, double coverage)
{
  ExtractedPatch patch;
  patch.fit.status = FitStatus::Converged;
  patch.fit.patch.type =
      patch.fit.state.type = {SurfaceType::Plane, BoundaryType::Circle};
  patch.fit.patch.d[0] = 0.05;
  patch.fit.patch.c = patch.fit.state.centre = centre;
  const int n = stateLayoutOf(patch.fit.patch.type).size();
  patch.fit.state_covariance = 1e-6 * StateMatrix::Identity(n, n);
  patch.fit.chi2 = patch.fit.chi2_dof = 100;
  patch.validation.emplace().verdict = PatchVerdict::Accepted;
  patch.validation->coverage.share = coverage;
  return patch;
}

TEST(PatchChoice, QualityFallsWithEverythingThatIsWrong)
{
  const ExtractedPatch good = patchAt({0.0, 0.0, 1.0}, 0.9);
  ExtractedPatch other = patchAt({0.0, 0.0, 1.0}, 0.6);
  EXPECT_LT(quality(other), quality(good));
  other = good;
  other.fit.chi2 *= 2.0;
  EXPECT_NEAR(quality(other), 0.5 * quality(good), 1e-12);
  other.fit.chi2 /= 4.0; // better than the noise is no better
  EXPECT_EQ(quality(other), quality(good));
  other = good;
  other.fit.state_covariance *= 100.0;
  EXPECT_LT(quality(other), quality(good));
}

TEST(PatchChoice, KeepsTheBestASpacingApart)
{
  for (std::uint64_t c = 0; c < 20; ++c) {
    Random random(c);
    std::vector<ExtractedPatch> all;
    for (int i = 0; i < 60; ++i)
      all.push_back(patchAt(random.uniformVector(-0.5, 0.5), random.uniform(0.5, 1.0)));
    all[7].validation->verdict = PatchVerdict::CoverageTooLow;
    constexpr double kSpacing = 0.2;
    std::vector<ExtractedPatch> kept = all;
    EXPECT_EQ(keepBest(10, kSpacing, kept), 49);
    EXPECT_EQ(kept.size(), 11U); // with the one that was turned down
    std::vector<ExtractedPatch> good = acceptedAmong(kept);
    ASSERT_EQ(good.size(), 10U);
    for (const ExtractedPatch& patch : good)
      for (const ExtractedPatch& other : good)
        EXPECT_TRUE(&patch == &other ||
                    (patch.fit.patch.c - other.fit.patch.c).norm() >= kSpacing);
    // What is left out is worse than all, or near a better one.
    double worst = 1.0;
    for (const ExtractedPatch& patch : good)
      worst = std::min(worst, quality(patch));
    for (const ExtractedPatch& patch : all)
      EXPECT_TRUE(!isAccepted(patch) || quality(patch) <= worst ||
                  std::any_of(good.begin(), good.end(), [&](const auto& other) {
                    return (other.fit.patch.c - patch.fit.patch.c).norm() < kSpacing &&
                           quality(other) >= quality(patch);
                  }));
  }
}

TEST(PatchChoice, TakesNeighboursRatherThanTooFew)
{
  std::vector<ExtractedPatch> kept(5, patchAt({0.0, 0.0, 1.0}, 0.8));
  EXPECT_EQ(keepBest(3, 0.1, kept), 2);
  EXPECT_EQ(kept.size(), 3U);
  EXPECT_EQ(keepBest(3, 0.1, kept), 0);
}

TEST(PatchChoice, LeavesOutWhatBetterOnesCover)
{
  // 0: points 0-99; 1: 50-149, worse; 2: 0-19 and 100-179, worst.
  std::vector<ExtractedPatch> patches{patchAt({0.0, 0.0, 1.0}, 0.9),
                                      patchAt({0.1, 0.0, 1.0}, 0.8),
                                      patchAt({0.2, 0.0, 1.0}, 0.7)};
  std::vector<std::vector<int>> supports(3);
  for (int i = 0; i < 180; ++i) {
    if (i < 100)
      supports[0].push_back(i);
    if (i >= 50 && i < 150)
      supports[1].push_back(i);
    if (i < 20 || i >= 100)
      supports[2].push_back(i);
  }
  for (const auto& [limit, expected] :
       {std::pair{0.1, 1U}, {0.3, 2U}, {0.6, 2U}, {0.75, 3U}}) {
    std::vector<ExtractedPatch> kept = patches;
    thinOut(limit, supports, 180, kept);
    EXPECT_EQ(kept.size(), expected) << limit;
    EXPECT_EQ(kept.front().fit.patch.c, patches.front().fit.patch.c);
  }
}

}} // namespace holdfast
