#include "surface_patch.h"

#include "pixel_vectors.h"

#include <algorithm>
#include <cmath>

namespace holdfast {
namespace {

// Of the radius: the disc in the image that first tells how the surface is inclined.
// Its pixels lie within twice this of the seed on surfaces up to 60 degrees.
constexpr double kFirstShare = 0.35;

// Pixels of that disc to every side, at least: noise tilts the plane of fewer.
constexpr double kFirstPixels = 3.0;

// A neighbour may leave the surface by this times their distance, 45 degrees against
// it.
constexpr double kSlope = 1.0;

// Points further from the surface than this share of the radius, and than
// kOutlierSigmas of the noise, are none of it, even where no jump parts them from it:
// on the far side of an edge, or in the veil between two surfaces. So far out no tail
// of the noise is missed.
constexpr double kLargestDeparture = 1.0 / 3.0;
constexpr double kOutlierSigmas = 5.0;

// From the noise and the radius, m.
double
largestDeparture(const SurfacePatchSettings& settings, double sigma_z)
{
  const double noise = kOutlierSigmas * sigma_z;
  return settings.strictness == Strictness::Strict ?
             noise :
             std::max(kLargestDeparture * settings.radius_m, noise);
}

// Within which the surface is fitted.
double
fittedRadius(const SurfacePatchSettings& settings)
{
  return settings.strictness == Strictness::Strict ? 0.5 * settings.radius_m :
                                                     settings.radius_m;
}

// So that no more samples are taken of so many.
std::size_t
stepOver(std::size_t size)
{
  constexpr std::size_t kMost = RaySamples::kMost;
  return std::max<std::size_t>(1, (size + kMost - 1) / kMost);
}

class Search {
public:
  Search(const PixelGrid& grid,
         int seed,
         double sigma_z,
         const SurfacePatchSettings& settings,
         SurfacePatchScratch& scratch)
  : grid_(grid)
  , settings_(settings)
  , scratch_(scratch)
  , u0_(seed % grid.camera.width)
  , v0_(seed / grid.camera.width)
  , depth_(grid.depth[static_cast<std::size_t>(seed)])
  , sigma_(sigma_z / (depth_ * depth_))
  , surface_(seedRay(), depth_)
  {}

  Eigen::Vector2d seedRay() const
  {
    const Camera& camera = grid_.camera;
    return {(u0_ - camera.cx) / camera.fx, (v0_ - camera.cy) / camera.fy};
  }

  void fitPlane(const std::vector<int>& pixels)
  {
    surface_.fitPlane(samplesOf(pixels));
  }

  void fitQuadric(const std::vector<int>& pixels)
  {
    surface_.fitQuadric(samplesOf(pixels), sigma_);
  }

  // The connected pixels within a radius on the surface found so far.
  void collect(double radius_m, double departure_m, std::vector<int>& indices)
  {
    // Beyond the disc on the tangent plane, for the disc on the curved surface.
    constexpr double kMargin = 1.2;
    const LateralDisc disc(surface_, radius_m);
    const LateralDisc about =
        surface_.isPlane() ? disc : LateralDisc(surface_, kMargin * radius_m);
    const PixelWindow window = grid_.ballWindow(surface_.point(), kMargin * radius_m);
    const int columns = window.columns.end - window.columns.begin;
    const int rows = window.rows.end - window.rows.begin;
    indices.clear();
    if (columns <= 0 || rows <= 0)
      return;
    const auto size =
        static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows);
    scratch_.window.resize(size + kRowPadding);
    scratch_.chords.resize(static_cast<std::size_t>(rows));
    PixelRange* const chords = scratch_.chords.data();
    float* const first = scratch_.window.data() - window.columns.begin -
                         static_cast<std::ptrdiff_t>(window.rows.begin) * columns;
    const SeedPixel seed{u0_, v0_, grid_.camera.fx, grid_.camera.fy};
    discChords(about, seed, window, chords);
    const auto gate = static_cast<float>(departure_m / (depth_ * depth_));
    surfaceDepartures({disc, seed, grid_.rows(), gate},
                      {window.rows, chords},
                      first,
                      columns);
    PixelRuns connected({first, columns}, jump(), scratch_.runs);
    for (int v = window.rows.begin; v < window.rows.end; ++v)
      connected.addRow(v, chords[v - window.rows.begin]);
    connected.component(u0_, v0_, grid_.camera.width, indices);
  }

private:
  // Some of the pixels, which ascend.
  RaySamples samplesOf(const std::vector<int>& pixels) const
  {
    const Camera& camera = grid_.camera;
    const auto step = stepOver(pixels.size());
    const double per_column = 1.0 / camera.fx, per_row = 1.0 / camera.fy;
    RaySamples samples;
    int row = 0, row_begin = 0;
    for (std::size_t i = step / 2; i < pixels.size(); i += step) {
      if (pixels[i] >= row_begin + camera.width) {
        row = pixels[i] / camera.width;
        row_begin = row * camera.width;
      }
      samples.add((pixels[i] - row_begin - u0_) * per_column,
                  (row - v0_) * per_row,
                  1.0 / grid_.depth[static_cast<std::size_t>(pixels[i])]);
    }
    return samples;
  }

  PixelJump jump() const
  {
    const double noise = settings_.jump_sigmas * sigma_;
    const double slope = kSlope / depth_; // of 1/z, per slope of the ray
    return {static_cast<float>(std::max(noise, slope / grid_.camera.fx)),
            static_cast<float>(std::max(noise, slope / grid_.camera.fy))};
  }

  const PixelGrid& grid_;
  const SurfacePatchSettings& settings_;
  SurfacePatchScratch& scratch_;
  int u0_, v0_;
  double depth_;
  double sigma_; // of 1/z
  ReferenceSurface surface_;
};

} // namespace

void
surfacePatch(const PixelGrid& grid,
             const SurfaceSeed& seed,
             const SurfacePatchSettings& settings,
             SurfacePatchScratch& scratch,
             std::vector<int>& indices)
{
  const double radius = settings.radius_m;
  const double depth = grid.depth[static_cast<std::size_t>(seed.pixel)];
  const double pixel = depth / std::min(grid.camera.fx, grid.camera.fy);
  Search search(grid, seed.pixel, seed.sigma_z, settings, scratch);
  connectedDisc(grid,
                seed.pixel,
                std::max(kFirstShare * radius, kFirstPixels * pixel),
                seed.limit,
                scratch.runs,
                scratch.pixels);
  search.fitPlane(scratch.pixels);
  const double departure = largestDeparture(settings, seed.sigma_z);
  search.collect(fittedRadius(settings),
                 std::max(kLargestDeparture * radius, departure),
                 scratch.pixels);
  search.fitQuadric(scratch.pixels);
  search.collect(radius, departure, indices);
  // The seed itself may be an outlier of its surface.
  if (indices.empty())
    indices.push_back(seed.pixel);
}

namespace {

// The candidates' rays, from the seed's, and their 1/z.
struct Rays {
  const Eigen::Vector2d seed;
  const std::vector<Eigen::Vector3d>& points;

  Eigen::Vector2d slopes(std::size_t i) const
  {
    return points[i].head<2>() / points[i].z() - seed;
  }
};

// Some of the candidates within a disc on the surface found so far.
RaySamples
samplesWithin(double radius_m,
              const Rays& rays,
              const ReferenceSurface& surface,
              std::vector<int>& members)
{
  const LateralDisc disc(surface, radius_m);
  members.clear();
  for (std::size_t i = 0; i < rays.points.size(); ++i) {
    const Eigen::Vector2d slopes = rays.slopes(i);
    if (disc.contains(slopes.x(), slopes.y()))
      members.push_back(static_cast<int>(i));
  }
  RaySamples samples;
  const std::size_t step = stepOver(members.size());
  for (std::size_t i = step / 2; i < members.size(); i += step) {
    const auto member = static_cast<std::size_t>(members[i]);
    const Eigen::Vector2d slopes = rays.slopes(member);
    samples.add(slopes.x(), slopes.y(), 1.0 / rays.points[member].z());
  }
  return samples;
}

} // namespace

void
surfaceMembers(const Eigen::Vector3d& seed,
               const std::vector<Eigen::Vector3d>& candidates,
               double sigma_z,
               const SurfacePatchSettings& settings,
               SurfacePatchScratch& scratch,
               std::vector<bool>& belongs)
{
  const Eigen::Vector2d ray(seed.x() / seed.z(), seed.y() / seed.z());
  ReferenceSurface surface(ray, seed.z());
  const Rays rays{ray, candidates};
  const double radius = settings.radius_m;
  const double sigma = sigma_z / (seed.z() * seed.z());
  surface.fitPlane(samplesWithin(kFirstShare * radius, rays, surface, scratch.members));
  surface.fitQuadric(
      samplesWithin(fittedRadius(settings), rays, surface, scratch.members),
      sigma);
  const LateralDisc within(surface, radius);
  const double gate = largestDeparture(settings, sigma_z) / (seed.z() * seed.z());
  belongs.assign(candidates.size(), false);
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    const Eigen::Vector2d slopes = rays.slopes(i);
    const double rho = surface.inverseDepth(slopes.x(), slopes.y());
    belongs[i] = rho > 0.0 && candidates[i].z() > 0.0 &&
                 within.excess(slopes.x(), slopes.y(), rho) <= 0.0 &&
                 std::abs(1.0 / candidates[i].z() - rho) <= gate;
  }
}

} // namespace holdfast
