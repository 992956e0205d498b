#include <holdfast/pcl/neighborhood_sampler.h>

#include "sampling_budget.h"

#include "ball_grid.h"
#include "nearest_points.h"
#include "path_search.h"
#include "pixel_disc.h"
#include "seeds.h"
#include "surface_patch.h"

#include "parallel/thread_memory.h"
#include "validation/patch_rays.h"

#include <pcl/common/point_tests.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace holdfast {

namespace {

bool
isPositive(double x)
{
  return std::isfinite(x) && x > 0.0;
}

bool
isNotNegative(double x)
{
  return std::isfinite(x) && x >= 0.0;
}

} // namespace

struct NeighborhoodSampler::Scratch {
  SurfacePatchScratch patch;
  std::vector<bool> belongs;
  std::vector<Eigen::Vector3d> candidates;
  RunMemory runs;
  std::vector<PathEnd> heap;
  std::vector<float> path_length;
  std::vector<int> ball;
  std::vector<PathEnd> nearest;
  std::vector<int> found;
};

void
NeighborhoodSampler::ScratchDeleter::operator()(Scratch* scratch) const
{
  delete scratch;
}

struct NeighborhoodSampler::Impl {
  Impl(const RangeCloud& the_cloud, const Sensor& the_sensor, const SamplerOptions& o);

  bool isValid(int index) const;
  std::vector<int> validPoints() const;
  std::vector<int> gridSeeds(int max_seeds) const;
  std::vector<int> shuffled(std::vector<int> seeds) const;
  std::vector<int> seeds() const;

  void neighborhood(int seed,
                    Strictness strictness,
                    Scratch& scratch,
                    std::vector<int>& indices) const;
  void patch(int seed,
             Strictness strictness,
             Scratch& scratch,
             std::vector<int>& indices) const;
  void treePatch(int seed,
                 const SurfacePatchSettings& settings,
                 Scratch& scratch,
                 std::vector<int>& indices) const;
  void disc(int seed, Scratch& scratch, std::vector<int>& indices) const;
  void ball(int seed, std::vector<int>& indices) const;
  void geodesic(int seed, Scratch& scratch, std::vector<int>& indices) const;
  void knn(int seed, Scratch& scratch, std::vector<int>& indices) const;

  void gridBall(int seed, std::vector<int>& indices) const;
  void pointsWithin(int seed, double radius, std::vector<int>& indices) const;
  void gridGeodesic(int seed, Scratch& scratch, std::vector<int>& indices) const;
  void treeGeodesic(int seed, Scratch& scratch, std::vector<int>& indices) const;

  double strayShare(int seed, const Patch& patch) const;

  Eigen::Vector3d inCamera(int index) const;
  PixelWindow windowAround(int seed) const;
  double depthSigma(int seed) const;
  JumpLimit jumpLimit(int seed) const;
  JumpLimit jumpLimit(int seed, double sigma_z) const;
  float distance(int a, int b) const;

  const RangeCloud& cloud;
  const pcl::PointCloud<pcl::PointXYZ>& points;
  NoiseModel::ConstPtr noise;
  SamplerOptions options;
  std::optional<PixelGrid> grid;
  std::vector<double> column_slopes; ///< x/z of the grid's columns
  std::optional<BallGrid> balls; ///< without a pixel grid
  NearestPoints nearest_points; ///< where they are asked for
};

namespace {

const RangeCloud&
checked(const RangeCloud& cloud)
{
  const std::string error = validityError(cloud);
  if (!error.empty())
    throw std::invalid_argument(error);
  return cloud;
}

} // namespace

NeighborhoodSampler::Impl::Impl(const RangeCloud& the_cloud,
                                const Sensor& the_sensor,
                                const SamplerOptions& o)
: cloud(checked(the_cloud)), points(*cloud.points), noise(the_sensor.noise), options(o)
{
  const std::string error = validityError(options);
  if (!error.empty())
    throw std::invalid_argument(error);
  if (!noise)
    throw std::invalid_argument("the sensor has no noise model");
  grid = makePixelGrid(cloud, the_sensor);
  if (grid)
    for (int u = 0; u < grid->camera.width; ++u)
      column_slopes.push_back((u - grid->camera.cx) / grid->camera.fx);
  const bool nearest = options.neighborhood == Neighborhood::Knn;
  if (!grid && !nearest)
    balls.emplace(points, validPoints(), options.radius_m);
  if (nearest || (!grid && options.neighborhood == Neighborhood::Geodesic))
    nearest_points = NearestPoints(points, validPoints());
}

bool
NeighborhoodSampler::Impl::isValid(int index) const
{
  return grid ? !std::isnan(grid->depth[static_cast<std::size_t>(index)]) :
                pcl::isFinite(points[index]);
}

std::vector<int>
NeighborhoodSampler::Impl::validPoints() const
{
  std::vector<int> valid;
  for (int i = 0; i < static_cast<int>(points.size()); ++i)
    if (isValid(i))
      valid.push_back(i);
  return valid;
}

Eigen::Vector3d
NeighborhoodSampler::Impl::inCamera(int index) const
{
  return cloud.sensor_pose.toLocal(points[index].getVector3fMap().cast<double>());
}

PixelWindow
NeighborhoodSampler::Impl::windowAround(int seed) const
{
  return grid->ballWindow(inCamera(seed), options.radius_m);
}

float
NeighborhoodSampler::Impl::distance(int a, int b) const
{
  return (points[a].getVector3fMap() - points[b].getVector3fMap()).norm();
}

// Along the camera's axis, m.
double
NeighborhoodSampler::Impl::depthSigma(int seed) const
{
  double variance = 0.0;
  if (!cloud.hasCovariances())
    variance = noise->covariance(inCamera(seed))(2, 2);
  else {
    const Eigen::Vector3d axis = cloud.sensor_pose.R.col(2);
    const Eigen::Matrix3d S =
        (*cloud.covariances)[static_cast<std::size_t>(seed)].cast<double>();
    variance = axis.dot(S * axis);
  }
  // A covariance that is none (negative, NaN) is no reason to cut.
  return variance > 0.0 ? std::sqrt(variance) : 0.0;
}

JumpLimit
NeighborhoodSampler::Impl::jumpLimit(int seed) const
{
  return jumpLimit(seed, depthSigma(seed));
}

JumpLimit
NeighborhoodSampler::Impl::jumpLimit(int seed, double sigma_z) const
{
  return {static_cast<float>(options.jump_sigmas * sigma_z),
          options.max_slope * inCamera(seed).z()};
}

void
NeighborhoodSampler::Impl::patch(int seed,
                                 Strictness strictness,
                                 Scratch& scratch,
                                 std::vector<int>& indices) const
{
  const SurfacePatchSettings settings{options.radius_m,
                                      options.jump_sigmas,
                                      strictness};
  if (grid) {
    const double sigma = depthSigma(seed);
    surfacePatch(*grid,
                 {seed, jumpLimit(seed, sigma), sigma},
                 settings,
                 scratch.patch,
                 indices);
  }
  else if (noise->isOmnidirectional() || inCamera(seed).z() <= 0.0)
    pointsWithin(seed, options.radius_m, indices);
  else
    treePatch(seed, settings, scratch, indices);
}

void
NeighborhoodSampler::Impl::treePatch(int seed,
                                     const SurfacePatchSettings& settings,
                                     Scratch& scratch,
                                     std::vector<int>& indices) const
{
  // A patch that bends by half its radius reaches this much further than that; the
  // noise puts points off by some sigmas.
  constexpr double kMargin = 1.15, kSigmas = 4.0;
  const double sigma = depthSigma(seed);
  pointsWithin(seed, kMargin * options.radius_m + kSigmas * sigma, indices);
  scratch.candidates.clear();
  for (const int i : indices)
    scratch.candidates.push_back(inCamera(i));
  surfaceMembers(inCamera(seed),
                 scratch.candidates,
                 sigma,
                 settings,
                 scratch.patch,
                 scratch.belongs);
  std::size_t kept = 0;
  for (std::size_t i = 0; i < indices.size(); ++i)
    if (scratch.belongs[i] || indices[i] == seed)
      indices[kept++] = indices[i];
  indices.resize(kept);
}

void
NeighborhoodSampler::Impl::disc(int seed,
                                Scratch& scratch,
                                std::vector<int>& indices) const
{
  connectedDisc(*grid, seed, options.radius_m, jumpLimit(seed), scratch.runs, indices);
}

void
NeighborhoodSampler::Impl::ball(int seed, std::vector<int>& indices) const
{
  if (grid)
    gridBall(seed, indices);
  else
    pointsWithin(seed, options.radius_m, indices);
}

void
NeighborhoodSampler::Impl::gridBall(int seed, std::vector<int>& indices) const
{
  const PixelWindow window = windowAround(seed);
  const Eigen::Vector3f centre = points[seed].getVector3fMap();
  const float squared_radius = static_cast<float>(options.radius_m * options.radius_m);
  for (int v = window.rows.begin; v < window.rows.end; ++v) {
    const float* depth = grid->row(v);
    for (int u = window.columns.begin; u < window.columns.end; ++u) {
      const int i = v * grid->camera.width + u;
      const float d = (points[i].getVector3fMap() - centre).squaredNorm();
      if (d <= squared_radius && !std::isnan(depth[u]))
        indices.push_back(i);
    }
  }
}

void
NeighborhoodSampler::Impl::pointsWithin(int seed,
                                        double radius,
                                        std::vector<int>& indices) const
{
  balls->search(points[seed], radius, indices);
}

namespace {

constexpr std::array<std::pair<int, int>, 8> kNeighborPixels{
    {{-1, -1}, {0, -1}, {1, -1}, {-1, 0}, {1, 0}, {-1, 1}, {0, 1}, {1, 1}}};

bool
isInside(const PixelRange& range, int i)
{
  return i >= range.begin && i < range.end;
}

} // namespace

void
NeighborhoodSampler::Impl::geodesic(int seed,
                                    Scratch& scratch,
                                    std::vector<int>& indices) const
{
  if (grid)
    gridGeodesic(seed, scratch, indices);
  else
    treeGeodesic(seed, scratch, indices);
}

void
NeighborhoodSampler::Impl::gridGeodesic(int seed,
                                        Scratch& scratch,
                                        std::vector<int>& indices) const
{
  // No path is shorter than the straight line, so the window of the ball holds all.
  const PixelWindow window = windowAround(seed);
  const Camera& camera = grid->camera;
  const int columns = window.columns.end - window.columns.begin;
  const int rows = window.rows.end - window.rows.begin;
  const JumpLimit limit = jumpLimit(seed);
  const auto slotOf = [&](int u, int v) {
    return (v - window.rows.begin) * columns + (u - window.columns.begin);
  };
  const auto indexOf = [&](int slot) {
    return (slot / columns + window.rows.begin) * camera.width + slot % columns +
           window.columns.begin;
  };

  PathSearch paths(scratch.heap,
                   scratch.path_length,
                   static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows),
                   static_cast<float>(options.radius_m));
  paths.reach(slotOf(seed % camera.width, seed / camera.width), 0.0F);
  paths.run([&](int slot, float length) {
    const int from = indexOf(slot);
    for (const auto& [du, dv] : kNeighborPixels) {
      const int u = from % camera.width + du;
      const int v = from / camera.width + dv;
      if (!isInside(window.columns, u) || !isInside(window.rows, v))
        continue;
      const float jump = std::abs(grid->row(v)[u] - grid->row(v - dv)[u - du]);
      if (jump < limit.along(std::hypot(du / camera.fx, dv / camera.fy)))
        paths.reach(slotOf(u, v), length + distance(from, v * camera.width + u));
    }
  });
  for (int slot = 0; slot < columns * rows; ++slot)
    if (paths.isReached(slot))
      indices.push_back(indexOf(slot));
}

void
NeighborhoodSampler::Impl::treeGeodesic(int seed,
                                        Scratch& scratch,
                                        std::vector<int>& indices) const
{
  constexpr int kNeighbors = 8;
  std::vector<int>& within = scratch.ball;
  pointsWithin(seed, options.radius_m, within);
  const auto slotOf = [&within](int index) {
    const auto at = std::lower_bound(within.begin(), within.end(), index);
    return at != within.end() && *at == index ? static_cast<int>(at - within.begin()) :
                                                -1;
  };

  PathSearch paths(scratch.heap,
                   scratch.path_length,
                   within.size(),
                   static_cast<float>(options.radius_m));
  paths.reach(slotOf(seed), 0.0F);
  paths.run([&](int slot, float length) {
    const int from = within[static_cast<std::size_t>(slot)];
    // One more, since the point itself is the nearest.
    nearest_points.search(points[from], kNeighbors + 1, scratch.nearest, scratch.found);
    for (const int to : scratch.found)
      if (const int next = slotOf(to); next >= 0)
        paths.reach(next, length + distance(from, to));
  });
  for (int slot = 0; slot < static_cast<int>(within.size()); ++slot)
    if (paths.isReached(slot))
      indices.push_back(within[static_cast<std::size_t>(slot)]);
}

void
NeighborhoodSampler::Impl::knn(int seed,
                               Scratch& scratch,
                               std::vector<int>& indices) const
{
  nearest_points.search(points[seed],
                        static_cast<std::size_t>(options.k),
                        scratch.nearest,
                        indices);
  // Of more points than that at the same place the tree chooses the first.
  if (std::find(indices.begin(), indices.end(), seed) == indices.end())
    indices.back() = seed;
  std::sort(indices.begin(), indices.end());
}

std::vector<int>
NeighborhoodSampler::Impl::gridSeeds(int max_seeds) const
{
  return grid ? pixelGridSeeds(*grid, options.spacing_m, max_seeds) :
                voxelGridSeeds(points, validPoints(), options.spacing_m, max_seeds);
}

std::vector<int>
NeighborhoodSampler::Impl::shuffled(std::vector<int> seeds) const
{
  const std::size_t count = seeds.size();
  return randomSeeds(std::move(seeds), count, options.random_seed);
}

std::vector<int>
NeighborhoodSampler::Impl::seeds() const
{
  switch (options.strategy) {
  case SeedStrategy::Grid:
    return isLimited(options) ? shuffled(gridSeeds(options.max_seeds)) :
                                gridSeeds(options.max_seeds);
  case SeedStrategy::Random: {
    const std::size_t count = options.max_seeds > 0 ?
                                  static_cast<std::size_t>(options.max_seeds) :
                                  gridSeeds(0).size();
    return randomSeeds(validPoints(), count, options.random_seed);
  }
  case SeedStrategy::Poisson:
    return poissonSeeds(points,
                        validPoints(),
                        options.spacing_m,
                        options.max_seeds,
                        options.random_seed);
  }
  return {};
}

SamplerOptions
withoutLimits(SamplerOptions options)
{
  options.max_patches = 0;
  options.max_area_m2 = 0.0;
  options.max_time_s = 0.0;
  return options;
}

std::string
validityError(const SamplerOptions& options)
{
  if (!isPositive(options.radius_m))
    return "the neighbourhood radius must be a positive number of metres";
  if (options.k < 1)
    return "a neighbourhood of nearest points needs at least one";
  if (options.max_seeds < 0)
    return "the number of seeds must not be negative";
  if (!isPositive(options.spacing_m))
    return "the seed spacing must be a positive number of metres";
  if (options.max_patches < 0)
    return "the number of patches must not be negative";
  if (!isNotNegative(options.max_area_m2))
    return "the area to cover must not be a negative number of square metres";
  if (!isNotNegative(options.max_time_s))
    return "the time must not be a negative number of seconds";
  if (!isNotNegative(options.jump_sigmas))
    return "the depth jump must not be a negative number of sigmas";
  if (!isNotNegative(options.max_slope))
    return "the largest slope must not be negative";
  return {};
}

NeighborhoodSampler::NeighborhoodSampler(const RangeCloud& cloud,
                                         const Sensor& sensor,
                                         const SamplerOptions& options)
: impl_(std::make_unique<const Impl>(cloud, sensor, options))
{}

NeighborhoodSampler::~NeighborhoodSampler() = default;

std::vector<int>
NeighborhoodSampler::seeds() const
{
  return impl_->seeds();
}

const SamplerOptions&
NeighborhoodSampler::options() const
{
  return impl_->options;
}

bool
NeighborhoodSampler::usesPixels() const
{
  return impl_->grid.has_value();
}

NeighborhoodSampler::ScratchPtr
NeighborhoodSampler::makeScratch() const
{
  return ScratchPtr(new Scratch);
}

void
NeighborhoodSampler::Impl::neighborhood(int seed,
                                        Strictness strictness,
                                        Scratch& scratch,
                                        std::vector<int>& indices) const
{
  if (seed < 0 || seed >= static_cast<int>(points.size()))
    throw std::invalid_argument("the cloud has no point " + std::to_string(seed));
  indices.clear();
  if (!isValid(seed))
    return;
  switch (options.neighborhood) {
  case Neighborhood::Patch:
    return patch(seed, strictness, scratch, indices);
  case Neighborhood::Disc:
    if (grid)
      return disc(seed, scratch, indices);
    return pointsWithin(seed, options.radius_m, indices);
  case Neighborhood::Ball:
    return ball(seed, indices);
  case Neighborhood::Geodesic:
    return geodesic(seed, scratch, indices);
  case Neighborhood::Knn:
    return knn(seed, scratch, indices);
  }
}

double
NeighborhoodSampler::Impl::strayShare(int seed, const Patch& patch) const
{
  constexpr double kPixels = 100.0, kSigmas = 4.0;
  const Eigen::Vector3d centre = cloud.sensor_pose.toLocal(patch.c);
  const PixelWindow window = grid->ballWindow(centre, patch.d.head<4>().maxCoeff());
  const int columns = window.columns.end - window.columns.begin;
  const int rows = window.rows.end - window.rows.begin;
  const double pixels = static_cast<double>(columns) * rows;
  const int step = std::max(1, static_cast<int>(std::sqrt(pixels / kPixels)));
  // Kept between patches: no allocation once it has seen the largest window.
  auto& rays = threadMemory<PatchRays, struct RaysOfWindow>();
  rays.clear();
  const int first = window.columns.begin + step / 2;
  const int per_row = (window.columns.end - first + step - 1) / step;
  for (int v = window.rows.begin + step / 2; v < window.rows.end; v += step)
    rays.addRow(column_slopes.data() + first,
                (v - grid->camera.cy) / grid->camera.fy,
                grid->row(v) + first,
                step,
                per_row);
  const double z = inCamera(seed).z();
  const double sigma = depthSigma(seed) / (z * z); // of 1/z
  return rays.strayShare(patch, cloud.sensor_pose, kSigmas * sigma);
}

double
NeighborhoodSampler::strayShare(int seed, const Patch& patch) const
{
  return impl_->grid && impl_->isValid(seed) ? impl_->strayShare(seed, patch) : 0.0;
}

void
NeighborhoodSampler::neighborhood(int seed,
                                  Scratch& scratch,
                                  std::vector<int>& indices) const
{
  impl_->neighborhood(seed, Strictness::Usual, scratch, indices);
}

void
NeighborhoodSampler::strictNeighborhood(int seed,
                                        Scratch& scratch,
                                        std::vector<int>& indices) const
{
  impl_->neighborhood(seed, Strictness::Strict, scratch, indices);
}

} // namespace holdfast
