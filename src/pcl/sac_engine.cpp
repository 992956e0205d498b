#include <holdfast/pcl/impl/sac_engine.h>
#include <holdfast/sensor/constant_noise_model.h>
#include <holdfast/validation/residual.h>

#include "point_gatherer.h"
#include "sac_doubts.h"
#include "sac_surface.h"

#include <pcl/common/point_tests.h>

#include <Eigen/Eigenvalues>
#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <numeric>
#include <stdexcept>

namespace holdfast {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

NoiseModel::ConstPtr
isotropicNoise(double sigma_m)
{
  return std::make_shared<const ConstantNoiseModel>(
      ConstantNoiseModel::Parameters{sigma_m, sigma_m});
}

FitOptions
fitOptions(const ConsensusOptions& options, SurfaceRequest surface)
{
  FitOptions fit = options.fit;
  fit.surface = surface;
  return fit;
}

// For fits that pass through all of their points: their surface is the same by either
// residual, and there is no noise to subtract.
FitOptions
sampleOptions(FitOptions fit)
{
  if (fit.surface == SurfaceRequest::Auto)
    fit.surface = SurfaceRequest::Paraboloid;
  fit.residual = Residual::Sampson;
  fit.debias_scatter = false;
  fit.max_iterations = 10; // most take five; samples of clutter would take them all
  return fit;
}

// The surface as the kernel sees it from the batch's origin.
kernel::State
kernelState(const Patch& patch, kernel::Model model, const Eigen::Vector3d& origin)
{
  const Pose pose = patch.pose();
  const Eigen::Vector2d k = patch.principalCurvatures();
  UnboundedSurface surface;
  surface.model = model;
  surface.R = pose.R;
  surface.c = pose.c - origin;
  if (model == kernel::Model::Paraboloid)
    surface.k = {k.x(), 0.0, k.y()};
  else
    surface.k[0] = k.y();
  return kernelState(surface, Scatter{});
}

// Makes padding of points without a usable covariance.
void
blankInvalid(PointBatch& batch)
{
  for (int i = 0; i < batch.size(); ++i) {
    if (batch.covariance(i).allFinite())
      continue;
    for (int c = 0; c <= PointBatch::W; ++c)
      batch.channel(static_cast<PointBatch::Channel>(c))[i] = 0.0;
  }
}

} // namespace

struct PatchConsensus::Impl {
  explicit Impl(const SacSurface& row) : surface(row)
  {
    cloud.points = pcl::make_shared<pcl::PointCloud<pcl::PointXYZ>>();
    prepare();
  }

  void prepare();
  bool isUsable(int index) const;
  std::vector<int> usable(const pcl::Indices& indices) const;
  Eigen::Vector3d position(int index) const;
  std::vector<double> squaredMetres(const Patch& patch,
                                    const std::vector<int>& indices) const;
  std::vector<double> squaredSigmas(const Patch& patch,
                                    const std::vector<int>& indices) const;
  void gather(const Patch& patch, const std::vector<int>& inliers, PointBatch&) const;
  double noiseSigma(const Patch& patch, const std::vector<int>& inliers) const;
  bool inMetres() const;
  double medianNoise(const pcl::Indices& indices) const;
  ConsensusFacts facts(const ConsensusLimits& limits,
                       const pcl::Indices& indices) const;

  const SacSurface& surface;
  RangeCloud cloud;
  Sensor sensor; ///< of which the noise may be null
  ConsensusOptions options;
  // What depends on these; without noise there are no gatherers.
  std::string input_error;
  std::optional<PatchEstimator> estimator;
  std::optional<PatchFitter> sample_fitter;
  std::unique_ptr<const PointGatherer> distance_gatherer;
  std::unique_ptr<const PointGatherer> fit_gatherer;
};

void
PatchConsensus::Impl::prepare()
{
  const FitOptions fit = fitOptions(options, surface.request);
  estimator.emplace(fit, options.covariance);
  sample_fitter.emplace(sampleOptions(fit));
  distance_gatherer.reset();
  fit_gatherer.reset();
  input_error = validityError(cloud);
  if (!input_error.empty() || (!sensor.noise && !cloud.hasCovariances()))
    return;
  // The model is not asked where there are covariances, but has to be there.
  Sensor model = sensor;
  if (!model.noise)
    model.noise = isotropicNoise(0.0);
  distance_gatherer = std::make_unique<const PointGatherer>(cloud, model.noise, false);
  fit_gatherer =
      std::make_unique<const PointGatherer>(cloud, model, fit.noise_at_surface);
}

bool
PatchConsensus::Impl::isUsable(int index) const
{
  return input_error.empty() && index >= 0 &&
         index < static_cast<int>(cloud.points->size()) &&
         pcl::isFinite((*cloud.points)[index]);
}

std::vector<int>
PatchConsensus::Impl::usable(const pcl::Indices& indices) const
{
  std::vector<int> result;
  std::copy_if(indices.begin(),
               indices.end(),
               std::back_inserter(result),
               [this](int index) { return isUsable(index); });
  return result;
}

Eigen::Vector3d
PatchConsensus::Impl::position(int index) const
{
  return (*cloud.points)[index].getVector3fMap().cast<double>();
}

std::vector<double>
PatchConsensus::Impl::squaredMetres(const Patch& patch,
                                    const std::vector<int>& indices) const
{
  std::vector<Eigen::Vector3d> points;
  points.reserve(indices.size());
  for (const int index : indices)
    points.push_back(position(index));
  std::vector<double> distances = distancesToSurface(patch, points);
  for (double& distance : distances)
    distance *= distance;
  return distances;
}

std::vector<double>
PatchConsensus::Impl::squaredSigmas(const Patch& patch,
                                    const std::vector<int>& indices) const
{
  PointBatch batch;
  distance_gatherer->gather(indices, patch.c, batch);
  batch.applyFloor(options.fit.sigma_floor_m);
  blankInvalid(batch);
  batch.pad();
  std::vector<double> squared(static_cast<std::size_t>(batch.paddedSize()));
  kernel::kernel().squaredResiduals(surface.model,
                                    options.fit.residual,
                                    kernelPoints(batch),
                                    kernelState(patch, surface.model, batch.origin()),
                                    squared.data());
  squared.resize(indices.size());
  const double* weight = batch.channel(PointBatch::W);
  // Indefinite covariances make it negative.
  for (std::size_t i = 0; i < squared.size(); ++i)
    if (!(weight[i] > 0.0 && squared[i] >= 0.0))
      squared[i] = kInfinity;
  return squared;
}

// The sigma of isotropic noise that explains the inliers' distances.
double
PatchConsensus::Impl::noiseSigma(const Patch& patch,
                                 const std::vector<int>& inliers) const
{
  const std::vector<double> squared = squaredMetres(patch, inliers);
  const double sum = std::accumulate(squared.begin(), squared.end(), 0.0);
  const int dof =
      static_cast<int>(inliers.size()) - kernel::parameterCount(surface.model);
  return std::max(std::sqrt(sum / std::max(dof, 1)), options.fit.sigma_floor_m);
}

bool
PatchConsensus::Impl::inMetres() const
{
  return options.distance == ConsensusDistance::Euclidean || !distance_gatherer;
}

// Over a sample of the points, always the same; NaN where none has a usable covariance.
double
PatchConsensus::Impl::medianNoise(const pcl::Indices& indices) const
{
  constexpr std::size_t kMost = 256;
  const std::size_t count = std::min(kMost, indices.size());
  pcl::Indices sample;
  for (std::size_t i = 0; i < count; ++i)
    sample.push_back(indices[i * indices.size() / count]);
  const std::vector<int> points = usable(sample);
  std::vector<double> sigmas;
  if (!points.empty() && distance_gatherer) {
    PointBatch batch;
    distance_gatherer->gather(points, position(points.front()), batch);
    for (int i = 0; i < batch.size(); ++i)
      if (const Eigen::Matrix3d Sigma = batch.covariance(i); Sigma.allFinite()) {
        const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(
            Sigma,
            Eigen::EigenvaluesOnly);
        if (solver.eigenvalues()[0] >= 0.0)
          sigmas.push_back(std::sqrt(solver.eigenvalues()[2]));
      }
  }
  if (sigmas.empty())
    return std::numeric_limits<double>::quiet_NaN();
  const auto middle = sigmas.begin() + static_cast<std::ptrdiff_t>(sigmas.size() / 2);
  std::nth_element(sigmas.begin(), middle, sigmas.end());
  return *middle;
}

ConsensusFacts
PatchConsensus::Impl::facts(const ConsensusLimits& limits,
                            const pcl::Indices& indices) const
{
  ConsensusFacts facts;
  facts.cloud = measureCloud(*cloud.points, cloud.sensor_pose.c);
  facts.limits = limits;
  facts.unit =
      inMetres() ? ConsensusDistance::Euclidean : ConsensusDistance::Mahalanobis;
  facts.for_want_of_noise = options.distance != facts.unit;
  facts.noise_known = distance_gatherer != nullptr;
  facts.noise_m = medianNoise(indices);
  facts.curved = surface.model != kernel::Model::Plane;
  return facts;
}

void
PatchConsensus::Impl::gather(const Patch& patch,
                             const std::vector<int>& inliers,
                             PointBatch& batch) const
{
  const Eigen::Vector3d origin =
      inliers.empty() ? Eigen::Vector3d::Zero() : position(inliers.front());
  if (fit_gatherer)
    fit_gatherer->gather(inliers, origin, batch);
  else
    PointGatherer(cloud, isotropicNoise(noiseSigma(patch, inliers)), false)
        .gather(inliers, origin, batch);
}

PatchConsensus::PatchConsensus(SurfaceRequest surface)
: impl_(std::make_unique<Impl>(sacSurface(surface)))
{}

PatchConsensus::~PatchConsensus() = default;
PatchConsensus::PatchConsensus(PatchConsensus&&) noexcept = default;
PatchConsensus& PatchConsensus::operator=(PatchConsensus&&) noexcept = default;

void
PatchConsensus::setCloud(const RangeCloud& cloud)
{
  impl_->cloud = cloud;
  impl_->prepare();
}

void
PatchConsensus::setSensor(const Sensor& sensor)
{
  impl_->sensor = sensor;
  impl_->prepare();
}

void
PatchConsensus::setOptions(const ConsensusOptions& options)
{
  if (const std::string error = validityError(options.fit); !error.empty())
    throw std::invalid_argument(error);
  impl_->options = options;
  impl_->prepare();
}

const ConsensusOptions&
PatchConsensus::options() const
{
  return impl_->options;
}

const std::string&
PatchConsensus::inputError() const
{
  return impl_->input_error;
}

SurfaceRequest
PatchConsensus::surface() const
{
  return impl_->surface.request;
}

int
PatchConsensus::modelType() const
{
  return impl_->surface.model_type;
}

unsigned int
PatchConsensus::sampleSize() const
{
  return impl_->surface.sample_size;
}

unsigned int
PatchConsensus::modelSize() const
{
  return impl_->surface.model_size;
}

std::string
PatchConsensus::sampleError(const pcl::Indices& indices) const
{
  unsigned int finite = 0;
  for (auto i = indices.begin(); i != indices.end() && finite < sampleSize(); ++i)
    if (impl_->isUsable(*i))
      ++finite;
  if (finite == sampleSize())
    return {};
  if (finite == 0 && !indices.empty())
    return fmt::format("none of the {} points is finite", indices.size());
  return fmt::format("a sample takes {} points, but {} of the {} points are finite",
                     sampleSize(),
                     finite,
                     indices.size());
}

ConsensusDistance
PatchConsensus::distanceUnit() const
{
  return impl_->inMetres() ? ConsensusDistance::Euclidean :
                             ConsensusDistance::Mahalanobis;
}

std::vector<std::string>
PatchConsensus::doubts(const ConsensusLimits& limits, const pcl::Indices& indices) const
{
  if (!impl_->input_error.empty())
    return {impl_->input_error};
  return doubtsAbout(impl_->facts(limits, indices));
}

std::string
PatchConsensus::explainNothing(const ConsensusLimits& limits,
                               const pcl::Indices& indices) const
{
  if (!impl_->input_error.empty())
    return "no patch: " + impl_->input_error;
  return whyNothing(impl_->facts(limits, indices));
}

bool
PatchConsensus::isSample(const pcl::Indices& sample) const
{
  return sample.size() == sampleSize() && impl_->usable(sample).size() == sample.size();
}

std::optional<SurfaceCoefficients>
PatchConsensus::solve(const pcl::Indices& sample) const
{
  if (!isSample(sample))
    return std::nullopt;
  Sample points;
  for (const int index : sample)
    points.push_back(impl_->position(index));
  const std::optional<Patch> patch =
      impl_->surface.solve(points, impl_->cloud.sensor_pose.c, *impl_->sample_fitter);
  if (!patch)
    return std::nullopt;
  return coefficientsOf(*patch);
}

std::optional<Patch>
PatchConsensus::surfaceFrom(const Eigen::VectorXf& coefficients) const
{
  if (coefficients.size() != modelSize() || !coefficients.allFinite())
    return std::nullopt;
  return impl_->surface.fromCoefficients(coefficients.cast<double>());
}

SurfaceCoefficients
PatchConsensus::coefficientsOf(const Patch& patch) const
{
  return impl_->surface.toCoefficients(patch).cast<float>();
}

std::vector<double>
PatchConsensus::squaredDistances(const Patch& surface,
                                 const pcl::Indices& indices) const
{
  constexpr std::size_t kBlock = 512; // points that fit into the caches together
  const bool metres = impl_->inMetres();
  std::vector<double> squared(indices.size(), kInfinity);
  std::vector<int> block;
  std::vector<std::size_t> slots;
  for (std::size_t begin = 0; begin < indices.size(); begin += kBlock) {
    const std::size_t end = std::min(begin + kBlock, indices.size());
    block.clear();
    slots.clear();
    for (std::size_t i = begin; i < end; ++i)
      if (impl_->isUsable(indices[i])) {
        block.push_back(indices[i]);
        slots.push_back(i);
      }
    const std::vector<double> of_block = metres ? impl_->squaredMetres(surface, block) :
                                                  impl_->squaredSigmas(surface, block);
    for (std::size_t i = 0; i < slots.size(); ++i)
      squared[slots[i]] = of_block[i];
  }
  return squared;
}

FitResult
PatchConsensus::estimatePatch(const Patch& surface, const pcl::Indices& inliers) const
{
  PointBatch batch;
  impl_->gather(surface, impl_->usable(inliers), batch);
  return impl_->estimator->estimate(batch);
}

} // namespace holdfast
