/// \file Sample consensus for the surfaces of patches, with the noise of every point.
#pragma once

#include <holdfast/pcl/consensus_options.h>
#include <holdfast/pcl/range_cloud.h>
#include <holdfast/sensor/sensor.h>

#include <pcl/sample_consensus/sac_model.h>

#include <array>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

namespace holdfast {

class PatchConsensus;
struct ConsensusLimits;

/// A surface for PCL's sample consensus, fitted with the covariances of the points:
///
///   auto model = pcl::make_shared<SampleConsensusModelPatch<pcl::PointXYZ>>(
///       SurfaceRequest::Sphere, cloud);
///   model->setSensor(loadSensor("kinect_v1"));
///   pcl::RandomSampleConsensus<pcl::PointXYZ> ransac(model, 3.0); // sigmas, not
///   metres ransac.computeModel(); ransac.refineModel();
///   ... getInliers(inliers), getModelCoefficients(coefficients)
///   FitResult patch = model->estimatePatch(inliers, coefficients);
///
/// Coefficients, and the points of a sample:
///
///   plane                       3   a b c d, as PCL's
///   sphere                      4   centre, radius, as PCL's
///   circular cylinder           6   point on the axis, direction, radius, as PCL's
///   elliptic or hyperbolic
///   paraboloid, or any          6   kappa_x kappa_y r_x r_y r_z c_x c_y c_z
///   cylindric paraboloid        6   kappa r_x r_y r_z c_x c_y c_z
///   circular paraboloid         6   kappa r_x r_y c_x c_y c_z
///
/// in m, rad and 1/m; kappa, r and c are those of a patch (holdfast/patch/patch.h). No
/// model needs normals.
///
/// The noise comes from setInputCovariances(), else from the points themselves
/// (PointXYZCovariance), else from setNoiseModel() or setSensor(). Distances and
/// thresholds are in sigmas of it. Without any, they are in metres, as PCL's, and the
/// fit takes the noise to be the same for all points and all directions, and of the
/// size that the inliers' distances show. setOptions() asks for metres in any case;
/// getDistanceUnit() tells which of them it is.
///
/// Where RANSAC or PROSAC hand the model a threshold, or limits, that do not go with
/// its unit and the cloud, a PCL_WARN says so, once: 0.01 sigmas, 3 m, a cloud in
/// millimetres. The other methods keep the threshold to themselves: ask getNotices().
///
/// setRadiusLimits() bounds the radius of curvature of curved surfaces, for paraboloids
/// that of the stronger curvature.
///
/// Works with RANSAC, MSAC, LMedS and PROSAC. RRANSAC and RMSAC need
/// setFractionNrPretest(), in percent, so small that the pretest is of a few points: at
/// its default of 10 %, all of which must be inliers, PCL may loop forever. MLESAC
/// takes its sigma from the spread of the coordinates, in metres: use it with Euclidean
/// distances.
///
/// Errors are reported by PCL_ERROR; nothing throws.
template <typename PointT>
class SampleConsensusModelPatch : public pcl::SampleConsensusModel<PointT> {
public:
  using Base = pcl::SampleConsensusModel<PointT>;
  using PointCloud = typename Base::PointCloud;
  using PointCloudConstPtr = typename Base::PointCloudConstPtr;
  using Ptr = pcl::shared_ptr<SampleConsensusModelPatch<PointT>>;
  using ConstPtr = pcl::shared_ptr<const SampleConsensusModelPatch<PointT>>;

  /// \param random if true the random seed is the current time, else 12345.
  SampleConsensusModelPatch(SurfaceRequest surface,
                            const PointCloudConstPtr& cloud,
                            bool random = false);

  SampleConsensusModelPatch(SurfaceRequest surface,
                            const PointCloudConstPtr& cloud,
                            const pcl::Indices& indices,
                            bool random = false);

  ~SampleConsensusModelPatch() override;

  void setInputCloud(const PointCloudConstPtr& cloud) override;

  /// Covariances beside the cloud, one per point, m^2, in its frame; null: none.
  void setInputCovariances(const CovariancesConstPtr& covariances);

  CovariancesConstPtr getInputCovariances() const
  {
    return covariances_;
  }

  /// Errors of the points are independent then.
  void setNoiseModel(const NoiseModel::ConstPtr& noise);

  /// The noise of a sensor; where it has a pattern, the covariance of the refined model
  /// knows it.
  void setSensor(const Sensor& sensor);

  /// Where the sensor stood, q_cloud = R q_camera + c, in place of what the cloud says
  /// (see toRangeCloud()); nothing: the cloud decides again.
  void setSensorPose(const std::optional<Pose>& pose);

  /// Options that make no sense are refused with PCL_ERROR.
  void setOptions(const ConsensusOptions& options);

  const ConsensusOptions& getOptions() const;

  /// The surface looked for.
  SurfaceRequest getSurface() const;

  /// A value of pcl::SacModel or PatchSacModel.
  pcl::SacModel getModelType() const override;

  /// What distances and thresholds are in: metres (Euclidean), too, where nothing is
  /// known of the noise.
  ConsensusDistance getDistanceUnit() const;

  /// What is doubtful about the cloud, its noise, the radius limits and a threshold of
  /// distances, one line each: what was given, what was expected, the likely cause. The
  /// use of that threshold does not warn of them any more.
  std::vector<std::string> getNotices(double threshold) const;

  /// One line on a search with a threshold that found nothing: validity, extent and
  /// point spacing of the cloud beside noise, threshold and radius limits, and the
  /// likely cause.
  std::string explainNothing(double threshold) const;

  /// Empty when there is input to take samples from, else what is wrong with it.
  std::string misuse() const;

  /// No samples, and PCL_ERROR, where misuse() finds some.
  void getSamples(int& iterations, pcl::Indices& samples) override;

  bool computeModelCoefficients(const pcl::Indices& samples,
                                Eigen::VectorXf& model_coefficients) const override;

  /// The weighted fit to the inliers. Where it fails, the coefficients stay what they
  /// were. Input and output may be the same vector.
  void optimizeModelCoefficients(
      const pcl::Indices& inliers,
      const Eigen::VectorXf& model_coefficients,
      Eigen::VectorXf& optimized_coefficients) const override;

  void getDistancesToModel(const Eigen::VectorXf& model_coefficients,
                           std::vector<double>& distances) const override;

  void selectWithinDistance(const Eigen::VectorXf& model_coefficients,
                            double threshold,
                            pcl::Indices& inliers) override;

  std::size_t countWithinDistance(const Eigen::VectorXf& model_coefficients,
                                  double threshold) const override;

  /// Moves the inliers to the nearest points of the surface.
  void projectPoints(const pcl::Indices& inliers,
                     const Eigen::VectorXf& model_coefficients,
                     PointCloud& projected_points,
                     bool copy_data_fields = true) const override;

  bool doSamplesVerifyModel(const std::set<pcl::index_t>& indices,
                            const Eigen::VectorXf& model_coefficients,
                            double threshold) const override;

  /// The bounded patch of inliers, with the covariance of its parameters: what
  /// optimizeModelCoefficients() fits. The covariance speaks of the noise of the
  /// inliers, not of which points became inliers: one whose threshold cuts the tails of
  /// the noise at 3 sigmas is too small by 3 % in variance.
  /// \param model_coefficients of the surface that they are inliers of.
  FitResult estimatePatch(const pcl::Indices& inliers,
                          const Eigen::VectorXf& model_coefficients) const;

protected:
  using Base::error_sqr_dists_;
  using Base::getClassName;
  using Base::indices_;
  using Base::input_;
  using Base::model_name_;
  using Base::model_size_;
  using Base::radius_max_;
  using Base::radius_min_;
  using Base::sample_size_;

  bool isSampleGood(const pcl::Indices& samples) const override;
  bool isModelValid(const Eigen::VectorXf& model_coefficients) const override;

private:
  void initialize();
  void updateCloud();
  std::optional<Patch> validSurface(const Eigen::VectorXf& model_coefficients) const;
  ConsensusLimits limits(double threshold) const;
  bool isNew(const ConsensusLimits& limits) const;
  void warnOnce(double threshold) const;

  std::unique_ptr<PatchConsensus> engine_;
  RangeCloud range_; ///< the input cloud with the covariances of its own points
  CovariancesConstPtr covariances_;
  std::optional<Pose> sensor_pose_;
  /// Threshold and radii that were spoken of; PCL counts inliers in many threads.
  mutable std::mutex notice_mutex_;
  mutable std::optional<std::array<double, 3>> noticed_;
};

} // namespace holdfast

#ifdef PCL_NO_PRECOMPILE
#include <holdfast/pcl/impl/sac_model_patch.hpp>
#endif
