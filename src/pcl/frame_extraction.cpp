#include <holdfast/pcl/frame_extraction.h>

#include "seeds.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace holdfast {

namespace {

/// Some pixels see nothing, and some patches are turned down.
constexpr int kSeedsPerPatch = 3;

/// More than any image has pixels.
constexpr int kMostPatches = 100'000'000;

ExtractionOptions
checked(ExtractionOptions options)
{
  SamplerOptions& sampler = options.sampler;
  const std::string error = validityError(sampler);
  if (!error.empty())
    throw std::invalid_argument(error);
  if (sampler.max_seeds == 0)
    sampler.max_seeds = kSeedsPerPatch * std::min(sampler.max_patches, kMostPatches);
  if (sampler.max_seeds == 0)
    throw std::invalid_argument("a stream needs a number of seeds or patches");
  options.keep_failures = true; // a seed's next turn depends on its last
  return options;
}

/// About `count` pixels, one in the middle of each cell of a square grid.
std::vector<int>
uniformPixels(int width, int height, int count)
{
  const double cells = std::max(1.0, std::sqrt(double(width) * height / count));
  std::vector<int> pixels;
  for (double v = 0.5 * cells; v < height; v += cells)
    for (double u = 0.5 * cells; u < width; u += cells)
      pixels.push_back(static_cast<int>(v) * width + static_cast<int>(u));
  return pixels;
}

/// Moves the seeds that had a turn and failed to the end, keeping the order otherwise.
void
putFailuresLast(const std::vector<ExtractedPatch>& attempts, std::vector<int>& seeds)
{
  std::vector<int> next;
  std::vector<int> failed;
  for (const ExtractedPatch& attempt : attempts)
    (isAccepted(attempt) ? next : failed).push_back(*attempt.seed_index);
  next.insert(next.end(),
              seeds.begin() + static_cast<std::ptrdiff_t>(attempts.size()),
              seeds.end());
  next.insert(next.end(), failed.begin(), failed.end());
  seeds = std::move(next);
}

} // namespace

FrameExtractor::FrameExtractor(const Sensor& sensor, const ExtractionOptions& options)
: sensor_(sensor), options_(checked(options))
{}

void
FrameExtractor::restart(int width, int height)
{
  width_ = width;
  height_ = height;
  seeds_ = uniformPixels(width, height, options_.sampler.max_seeds);
  seeds_ = randomSeeds(seeds_, seeds_.size(), options_.sampler.random_seed);
}

ExtractionResult
FrameExtractor::extract(const RangeCloud& frame, ExtractionResult former)
{
  if (const std::string error = validityError(frame); !error.empty())
    throw std::invalid_argument(error);
  const int width = static_cast<int>(frame.points->width);
  const int height = static_cast<int>(frame.points->height);
  if (height < 2)
    throw std::invalid_argument("a frame must be an organized cloud");
  if (width != width_ || height != height_)
    restart(width, height);
  ExtractionResult result = extractPatches(frame,
                                           sensor_,
                                           options_,
                                           {seedsAt(frame, seeds_), {}, {}},
                                           std::move(former));
  putFailuresLast(result.patches, seeds_);
  result.patches = acceptedAmong(std::move(result.patches));
  return result;
}

} // namespace holdfast
