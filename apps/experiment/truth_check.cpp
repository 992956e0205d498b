#include "truth_check.h"

#include "scene.h"

#include <holdfast/geometry/constants.h>
#include <holdfast/patch/surface.h>
#include <holdfast/patch_estimator.h>
#include <holdfast/pcl/neighborhood_sampler.h>

#include "pcl/pixel_grid.h"
#include "pcl/point_gatherer.h"

#include <pcl/common/point_tests.h>

#include <algorithm>
#include <cmath>

namespace holdfast::app {
namespace {

constexpr double kSigmas = 4.0;

/// True where the measured point that the pixel might show lies on the patch, too.
bool
agrees(const RangeImage& image,
       std::size_t pixel,
       const Patch& patch,
       const Eigen::Vector3d& on_patch)
{
  const Eigen::Vector3d n = patch.normal();
  const double sigma = std::sqrt(n.dot(image.covariances[pixel] * n));
  // NaN where nothing was there.
  return std::abs(n.dot(image.truth[pixel] - on_patch)) <= kSigmas * sigma;
}

/// The pixels that may see a ball, clipped to the image.
PixelWindow
windowOf(const RangeImage& image, const Camera& camera, const Patch& patch)
{
  const Eigen::Vector3d c = image.sensor_pose.toLocal(patch.c);
  const double reach = 1.5 * patch.d.head<4>().maxCoeff() / c.z();
  const auto range = [](double middle, double half, int size) {
    return PixelRange{std::clamp(static_cast<int>(middle - half), 0, size),
                      std::clamp(static_cast<int>(middle + half) + 2, 0, size)};
  };
  return {
      range(camera.fx * c.x() / c.z() + camera.cx, camera.fx * reach, image.width),
      range(camera.fy * c.y() / c.z() + camera.cy, camera.fy * reach, image.height)};
}

/// Calls visit(pixel, whether what is there agrees) for the pixels that see the patch.
/// \return true when too many do not agree.
template <typename Visit>
bool
visitPixels(const RangeImage& image,
            const Camera& camera,
            const Patch& patch,
            Visit&& visit)
{
  constexpr double kShare = 0.05;
  const PixelWindow window = windowOf(image, camera, patch);
  int seen = 0, left = 0;
  for (int v = window.rows.begin; v < window.rows.end; ++v)
    for (int u = window.columns.begin; u < window.columns.end; ++u) {
      const auto pixel = static_cast<std::size_t>(v * image.width + u);
      const Eigen::Vector3d& ray = image.directions[pixel];
      const auto t = intersectRay(patch, image.sensor_pose.c, ray);
      if (!t)
        continue;
      const bool agreed = agrees(image, pixel, patch, image.sensor_pose.c + *t * ray);
      ++seen;
      left += agreed ? 0 : 1;
      visit(pixel, agreed);
    }
  return left > kShare * seen;
}

/// Where the noise-free surface is smooth over a whole disc.
class SmoothSurface {
public:
  SmoothSurface(const RangeImage& image, const Sensor& sensor, double radius_m)
  : camera_(sensor.camera)
  , cloud_(trueCloudOf(image))
  , sampler_(cloud_, sensor, optionsFor(radius_m))
  , scratch_(sampler_.makeScratch())
  , gatherer_(cloud_, sensor, true)
  , radius_m_(radius_m)
  {}

  bool isSmoothAt(int pixel)
  {
    if (!pcl::isFinite((*cloud_.points)[pixel]))
      return false;
    const Eigen::Vector3d place =
        (*cloud_.points)[pixel].getVector3fMap().cast<double>();
    sampler_.neighborhood(pixel, *scratch_, indices_);
    gatherer_.gather(indices_, place, batch_);
    FitOptions options;
    options.debias_scatter = false; // true points have no noise to subtract
    const FitResult fit = estimatePatch(batch_, options);
    constexpr double kFull = 0.9, kHalfASigma = 0.25;
    return isUsable(fit.status) &&
           fit.points >= kFull * pixelsOfDisc(place, fit.patch.normal()) &&
           fit.chi2 <= kHalfASigma * fit.points;
  }

private:
  static SamplerOptions optionsFor(double radius_m)
  {
    SamplerOptions options;
    options.radius_m = radius_m;
    return options;
  }

  double pixelsOfDisc(const Eigen::Vector3d& place, const Eigen::Vector3d& normal) const
  {
    const Eigen::Vector3d q = cloud_.sensor_pose.toLocal(place);
    const Eigen::Vector3d ray = (place - cloud_.sensor_pose.c).normalized();
    const double cosine = std::abs(ray.dot(normal));
    // Of a pixel, whose ray is not along the camera's axis.
    const double along = q.z() / q.norm();
    return kPi * radius_m_ * radius_m_ * cosine * camera_.fx * camera_.fy /
           (q.z() * q.z() * along);
  }

  Camera camera_;
  RangeCloud cloud_;
  NeighborhoodSampler sampler_;
  NeighborhoodSampler::ScratchPtr scratch_;
  PointGatherer gatherer_;
  double radius_m_;
  std::vector<int> indices_;
  PointBatch batch_;
};

} // namespace

TruthCheck::TruthCheck(const RangeImage& image, const Sensor& sensor, double radius_m)
: image_(image), camera_(sensor.camera), sample_of_(image.truth.size(), -1)
{
  constexpr int kStep = 8;
  SmoothSurface surface(image, sensor, radius_m);
  for (int v = kStep / 2; v < image.height; v += kStep)
    for (int u = kStep / 2; u < image.width; u += kStep) {
      const int pixel = v * image.width + u;
      if (surface.isSmoothAt(pixel))
        sample_of_[static_cast<std::size_t>(pixel)] = smooth_samples_++;
    }
}

PatchTruth
TruthCheck::check(const Patch& patch) const
{
  PatchTruth truth;
  truth.over_edge =
      visitPixels(image_, camera_, patch, [&](std::size_t pixel, bool agreed) {
        if (agreed && sample_of_[pixel] >= 0)
          truth.covered.push_back(sample_of_[pixel]);
      });
  return truth;
}

bool
leavesTrueSurface(const RangeImage& image, const Camera& camera, const Patch& patch)
{
  return visitPixels(image, camera, patch, [](std::size_t, bool) {});
}

} // namespace holdfast::app
