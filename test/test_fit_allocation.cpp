// A batch that is refilled and an estimator that is reused take no memory from the
// heap: this program counts every allocation, its libraries' included.
#include "support/count_allocations.h"
#include "support/patch_batch.h"
#include "support/random_patch.h"
#include "support/spot.h"

#include <holdfast/fusion/patch_map.h>
#include <holdfast/patch_estimator.h>

namespace holdfast { namespace {

using test::Random;

class FitAllocation : public testing::TestWithParam<PatchType> {
protected:
  void SetUp() override
  {
#ifndef HOLDFAST_COUNTS_ALLOCATIONS
    GTEST_SKIP() << "allocations cannot be counted under a sanitizer";
#endif
  }
};

// Allocations of three rounds over the samples after a first one. The estimator reads
// from batches that it refills; filling and fitting both count.
long
allocationsInSteadyState(const std::vector<test::Sample>& samples,
                         const PatchEstimator& estimator)
{
  PointBatch batch;
  long before = 0;
  int usable = 0;
  for (int round = 0; round < 4; ++round) {
    if (round == 1)
      before = test::allocations;
    for (const test::Sample& sample : samples) {
      test::fillBatch(sample, batch);
      usable += isUsable(estimator.estimate(batch).status);
    }
  }
  const long count = test::allocations - before;
  EXPECT_EQ(usable, 4 * static_cast<int>(samples.size()));
  return count;
}

TEST_P(FitAllocation, NoneInSteadyState)
{
  Random random;
  std::vector<test::Sample> samples;
  for (int i = 0; i < 5; ++i) {
    samples.push_back(test::robotSample(GetParam(), 0.5, random));
    // Every normal on the same side.
    samples.back().viewpoint = {0.0, 0.0, 1.0};
  }
  FitOptions ray, paper = FitOptions::paper();
  ray.residual = Residual::Ray;
  for (FitOptions options : {FitOptions{}, ray, paper})
    for (const CovarianceMode mode :
         {CovarianceMode::Exact, CovarianceMode::GaussNewton}) {
      const PatchEstimator estimator(test::optionsFor(GetParam(), options), mode);
      EXPECT_EQ(allocationsInSteadyState(samples, estimator), 0);
    }
}

TEST_P(FitAllocation, IsCounted)
{
  const long before = test::allocations;
  // A direct call: compilers may leave out a pair of new and delete.
  ::operator delete(::operator new(10));
  PointBatch batch;
  batch.reserve(100);
  EXPECT_EQ(test::allocations - before, 2);
}

// A map takes memory for births and seeds alone.
TEST(MapAllocation, NoneInSteadyState)
{
#ifndef HOLDFAST_COUNTS_ALLOCATIONS
  GTEST_SKIP() << "allocations cannot be counted under a sanitizer";
#endif
  Random random;
  const PatchEstimator estimator(test::paraboloidOptions());
  const SpotView view(test::reliefScene(),
                      test::kinect(),
                      test::randomView(random),
                      Pose(),
                      0.05,
                      4);
  PatchMap map;
  std::vector<Measurement> measurements{*view.measure(estimator, random.engine())};
  map.update(measurements);
  map.update(measurements); // has seen what it keeps for candidates
  const long before = test::allocations;
  for (int frame = 0; frame < 10; ++frame) {
    map.move(Pose(), 1e-8 * JetMatrix::Identity());
    map.update(measurements);
  }
  EXPECT_EQ(test::allocations - before, 0);
  EXPECT_EQ(map.patches().size(), 1u);
}

INSTANTIATE_TEST_SUITE_P(AllTypes,
                         FitAllocation,
                         testing::ValuesIn(kPatchTypes),
                         test::patchTypeName);

}} // namespace holdfast
