#include <holdfast/sensor/pattern_map_calibration.h>

#include "pose_planes.h"

#include <Eigen/Core>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

namespace holdfast {
namespace {

// Of the Gaussian, px; its kernel ends at three of them.
constexpr std::array<double, 8> kSmoothings{0.0, 0.5, 0.7, 1.0, 1.4, 2.0, 2.8, 4.0};
constexpr double kKernelReach = 3.0;

// 2^-4 to 2^8: from a mean that is believed to none that is.
constexpr int kShrinkages = 25;

// What is further off counts as this many sigmas: feet of objects, edges.
constexpr float kLargestResidual = 3.0F;
constexpr float kNormalMad = 1.4826F; // sigma over the median absolute deviation

// Pixels with less than this part of a pose in their neighbourhood are unknown.
constexpr float kLeastSeen = 0.5F;

double
shrinkageOf(int k)
{
  return std::exp2(0.5 * k - 4.0);
}

/// What the planes leave of the mean disparities of one pose; NaN beside them.
std::vector<float>
residualsOf(const PlaneImages& images, std::size_t planes)
{
  std::vector<PlaneMoments> moments(planes + 1);
  const auto forEachPixel = [&](auto&& use) {
    for (std::size_t i = 0; i < images.mean.size(); ++i) {
      const auto width = static_cast<std::size_t>(images.width);
      if (images.plane[i] > 0 && std::isfinite(images.mean[i]))
        use(i,
            static_cast<std::size_t>(images.plane[i]),
            Eigen::Vector2d(i % width, i / width));
    }
  };
  forEachPixel([&](std::size_t i, std::size_t plane, const Eigen::Vector2d& at) {
    moments[plane].add(at.x(), at.y(), static_cast<double>(images.mean[i]));
  });
  std::vector<DisparityPlane> fitted;
  for (const PlaneMoments& sum : moments)
    fitted.push_back(sum.hasPlane() ? sum.plane() : DisparityPlane{});
  std::vector<float> residuals(images.mean.size(), kUnknownDisparity);
  forEachPixel([&](std::size_t i, std::size_t plane, const Eigen::Vector2d& at) {
    if (moments[plane].hasPlane())
      residuals[i] =
          static_cast<float>(static_cast<double>(images.mean[i]) - fitted[plane](at));
  });
  return residuals;
}

/// No residual is larger than some robust sigmas.
std::vector<float>
clipped(std::vector<float> residuals)
{
  std::vector<float> sizes;
  for (const float r : residuals)
    if (std::isfinite(r))
      sizes.push_back(std::abs(r));
  if (sizes.empty())
    return residuals;
  const auto middle = sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2);
  std::nth_element(sizes.begin(), middle, sizes.end());
  const float limit = kLargestResidual * kNormalMad * *middle;
  for (float& r : residuals)
    if (std::isfinite(r))
      r = std::clamp(r, -limit, limit);
  return residuals;
}

/// Sums over poses, or one pose alone, smoothed: residuals, and how many poses.
struct Sums {
  Eigen::ArrayXXf residuals; ///< column by row of the image
  Eigen::ArrayXXf poses;

  Sums& operator+=(const Sums& other)
  {
    residuals += other.residuals;
    poses += other.poses;
    return *this;
  }
};

/// Along the columns of the array, which are the rows of the image.
Eigen::ArrayXXf
smoothedAlong(const Eigen::ArrayXXf& image, const std::vector<float>& kernel)
{
  const auto reach = static_cast<Eigen::Index>(kernel.size()) - 1;
  Eigen::ArrayXXf sum = kernel[0] * image;
  for (Eigen::Index k = 1; k <= std::min(reach, image.rows() - 1); ++k) {
    const Eigen::Index n = image.rows() - k;
    sum.topRows(n) += kernel[static_cast<std::size_t>(k)] * image.bottomRows(n);
    sum.bottomRows(n) += kernel[static_cast<std::size_t>(k)] * image.topRows(n);
  }
  return sum;
}

Eigen::ArrayXXf
smoothed(const Eigen::ArrayXXf& image, double sigma)
{
  if (sigma == 0.0)
    return image;
  std::vector<float> kernel;
  float sum = 0.0F;
  for (int k = 0; k <= std::ceil(kKernelReach * sigma); ++k) {
    kernel.push_back(static_cast<float>(std::exp(-0.5 * k * k / (sigma * sigma))));
    sum += (k == 0 ? 1.0F : 2.0F) * kernel.back();
  }
  for (float& weight : kernel)
    weight /= sum;
  const Eigen::ArrayXXf once = smoothedAlong(image, kernel);
  return smoothedAlong(once.transpose(), kernel).transpose();
}

Sums
sumsOf(const std::vector<float>& residuals, int width, int height, double sigma)
{
  const Eigen::Map<const Eigen::ArrayXXf> image(residuals.data(), width, height);
  const auto is_there = image.isFinite();
  return {smoothed(is_there.select(image, 0.0F), sigma),
          smoothed(is_there.cast<float>(), sigma)};
}

/// The poses' residuals, and maps from them.
class PoseResiduals {
public:
  PoseResiduals(int width, int height) : width_(width), height_(height) {}

  void add(std::vector<float> residuals)
  {
    clipped_.push_back(clipped(residuals));
    residuals_.push_back(std::move(residuals));
  }

  /// Those of the pixels are to be judged that another pose saw, too.
  void findShared()
  {
    seen_.assign(residuals_.front().size(), 0);
    for (const std::vector<float>& residuals : residuals_)
      for (std::size_t i = 0; i < residuals.size(); ++i)
        seen_[i] += std::isfinite(residuals[i]) ? 1 : 0;
  }

  /// Sums over all poses but one; -1: over all.
  Sums sumsWithout(int left_out, double sigma) const
  {
    Sums sum{Eigen::ArrayXXf::Zero(width_, height_),
             Eigen::ArrayXXf::Zero(width_, height_)};
    for (std::size_t p = 0; p < clipped_.size(); ++p)
      if (static_cast<int>(p) != left_out)
        sum += sumsOf(clipped_[p], width_, height_, sigma);
    return sum;
  }

  /// Squares of what is left of each pose, by shrinkage, with the sums of the others.
  Eigen::ArrayXd squaresLeft(double sigma) const
  {
    Eigen::ArrayXd squares = Eigen::ArrayXd::Zero(kShrinkages);
    for (std::size_t p = 0; p < residuals_.size(); ++p) {
      const Sums others = sumsWithout(static_cast<int>(p), sigma);
      forEachJudged(p, [&](Eigen::Index i, double residual) {
        const double poses = static_cast<double>(others.poses(i));
        const double sum = poses < static_cast<double>(kLeastSeen) ?
                               0.0 :
                               static_cast<double>(others.residuals(i));
        for (int k = 0; k < kShrinkages; ++k) {
          const double left = residual - sum / (poses + shrinkageOf(k));
          squares[k] += left * left;
        }
      });
    }
    return squares;
  }

  /// Number and sum of squares of the residuals that are judged.
  std::pair<double, double> judged() const
  {
    double count = 0.0, squares = 0.0;
    for (std::size_t p = 0; p < residuals_.size(); ++p)
      forEachJudged(p, [&](Eigen::Index, double residual) {
        count += 1.0;
        squares += residual * residual;
      });
    return {count, squares};
  }

  PatternMap map(int left_out, double sigma, double shrinkage) const
  {
    const Sums sums = sumsWithout(left_out, sigma);
    const Eigen::ArrayXXf means =
        (sums.poses >= kLeastSeen)
            .select(sums.residuals / (sums.poses + static_cast<float>(shrinkage)),
                    kUnknownDisparity);
    return {width_, height_, {means.data(), means.data() + means.size()}};
  }

private:
  template <typename Use>
  void forEachJudged(std::size_t pose, Use&& use) const
  {
    const std::vector<float>& residuals = residuals_[pose];
    for (std::size_t i = 0; i < residuals.size(); ++i)
      if (seen_[i] > 1 && std::isfinite(residuals[i]))
        use(static_cast<Eigen::Index>(i), static_cast<double>(residuals[i]));
  }

  int width_;
  int height_;
  std::vector<std::vector<float>> residuals_; ///< by pose
  std::vector<std::vector<float>> clipped_;
  std::vector<int> seen_; ///< number of poses, by pixel
};

PoseFrames
lessMap(const PoseFrames& pose,
        const PatternMap& map,
        const NoiseCalibrationOptions& options)
{
  const double fb = options.focal_px * options.baseline_m;
  PoseFrames rest = pose;
  for (PointImage& frame : rest)
    for (std::size_t i = 0; i < frame.points.size(); ++i) {
      const Eigen::Vector3d q = frame.points[i].cast<double>();
      frame.points[i] = withoutDisparityError(q, map.error(i), fb).cast<float>();
    }
  return rest;
}

double
knownPart(const PatternMap& map)
{
  const auto unknown = std::count_if(map.errors().begin(),
                                     map.errors().end(),
                                     [](float e) { return std::isnan(e); });
  return 1.0 - static_cast<double>(unknown) / static_cast<double>(map.errors().size());
}

/// Smoothing and shrinkage that leave least, and the map with them.
void
chooseMap(const PoseResiduals& residuals, PatternMapCalibration& result)
{
  const auto [count, before] = residuals.judged();
  if (count == 0.0)
    return;
  double least = std::numeric_limits<double>::infinity();
  for (const double sigma : kSmoothings) {
    Eigen::Index k = 0;
    const double left = residuals.squaresLeft(sigma).minCoeff(&k);
    if (left < least) {
      least = left;
      result.smoothing_px = sigma;
      result.shrinkage = shrinkageOf(static_cast<int>(k));
    }
  }
  result.before_px = std::sqrt(before / count);
  result.after_px = std::sqrt(least / count);
  result.map = std::make_shared<const PatternMap>(
      residuals.map(-1, result.smoothing_px, result.shrinkage));
  result.known_part = knownPart(*result.map);
}

} // namespace

PatternMapCalibration
calibratePatternMap(const std::vector<PoseFrames>& poses,
                    const NoiseCalibrationOptions& options)
{
  if (const std::string error = validityError(options); !error.empty())
    throw std::invalid_argument(error);
  requireSameSizes(poses);
  if (poses.size() < 2)
    throw std::invalid_argument("a pattern map wants two poses or more");
  PatternMapCalibration result;
  std::vector<std::vector<Region>> planes_of;
  PoseResiduals residuals(poses.front().front().width, poses.front().front().height);
  for (const PoseFrames& pose : poses) {
    const PosePlanes planes = findPosePlanes(pose, options);
    result.status = planes.status;
    if (planes.status != NoiseCalibrationStatus::Ok)
      return result;
    residuals.add(residualsOf(planes.images, planes.regions.size()));
    planes_of.push_back(planes.regions);
    ++result.pose;
  }
  result.pose = 0;
  residuals.findShared();
  chooseMap(residuals, result);
  if (!result.map)
    return result;
  std::vector<PosePlanes> left;
  for (std::size_t p = 0; p < poses.size(); ++p) {
    const PatternMap others =
        residuals.map(static_cast<int>(p), result.smoothing_px, result.shrinkage);
    left.push_back(onPlanes(lessMap(poses[p], others, options), planes_of[p], options));
  }
  result.left = patternOn(std::move(left));
  result.left.shared_part = {};
  for (PatternRow& row : result.left.rows)
    row.between_poses = {};
  return result;
}

} // namespace holdfast
