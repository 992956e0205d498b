/// \file Segmentation of one patch by sample consensus, in one class.
#pragma once

#include <holdfast/pcl/sac_model_patch.h>

#include <pcl/segmentation/sac_segmentation.h>

#include <optional>
#include <string>
#include <vector>

namespace holdfast {

/// pcl::SACSegmentation with our models: the noise of every point decides what an
/// inlier is, and the result is a bounded patch with covariance.
///
///   PatchSegmentation<pcl::PointXYZ> segmentation;
///   segmentation.setInputCloud(cloud);
///   segmentation.setSensor(loadSensor("kinect_v1"));
///   segmentation.setModelType(pcl::SACMODEL_CYLINDER);
///   segmentation.setMethodType(pcl::SAC_RANSAC);
///   segmentation.setSigmaThreshold(3.0); // of each point's own noise
///   segmentation.setMaxIterations(1000);
///   segmentation.segment(inliers, coefficients);
///   if (!inliers.indices.empty())
///     use(segmentation.getPatch());
///   for (const std::string& notice : segmentation.getNotices())
///     ...
///
/// The threshold is in metres, setDistanceThreshold(), as PCL's, or in sigmas of each
/// point's noise, setSigmaThreshold(); the last one set holds. Where neither was set it
/// is 3 sigmas, and an error where nothing is known of the noise.
///
/// Model types are SACMODEL_PLANE, SACMODEL_SPHERE and SACMODEL_CYLINDER (which needs
/// no normals here), and those of PatchSacModel; any other is left to PCL and yields no
/// patch. Coefficients, noise, distances and the remarks on PCL's methods: see
/// SampleConsensusModelPatch. PCL's limit of 50 iterations suits planes only.
///
/// What goes wrong is said by PCL_ERROR, what looks wrong (thresholds, radii or clouds
/// of another unit) by PCL_WARN, and both by getNotices().
template <typename PointT>
class PatchSegmentation : public pcl::SACSegmentation<PointT> {
public:
  using Base = pcl::SACSegmentation<PointT>;
  using Ptr = pcl::shared_ptr<PatchSegmentation<PointT>>;
  using ConstPtr = pcl::shared_ptr<const PatchSegmentation<PointT>>;

  /// \param random if true the random seed is the current time, else 12345.
  explicit PatchSegmentation(bool random = false);

  // Not inline, so that programs need not link PCL's segmentation library.
  ~PatchSegmentation() override;

  /// Covariances beside the cloud, one per point, m^2, in its frame; null: none.
  void setInputCovariances(const CovariancesConstPtr& covariances)
  {
    covariances_ = covariances;
  }

  CovariancesConstPtr getInputCovariances() const
  {
    return covariances_;
  }

  /// Errors of the points are independent then.
  void setNoiseModel(const NoiseModel::ConstPtr& noise)
  {
    sensor_ = {};
    sensor_.noise = noise;
  }

  void setSensor(const Sensor& sensor)
  {
    sensor_ = sensor;
  }

  /// See SampleConsensusModelPatch::setSensorPose().
  void setSensorPose(const std::optional<Pose>& pose)
  {
    sensor_pose_ = pose;
  }

  /// Metres, to the nearest point of the surface, as PCL's: the same for near and far
  /// points. 0, PCL's default, is none.
  void setDistanceThreshold(double threshold_m)
  {
    sigma_threshold_.reset();
    Base::setDistanceThreshold(threshold_m);
  }

  /// Standard deviations of each point's noise; 3 keep 99.7 % of the points of a
  /// surface. Takes covariances, a noise model or a sensor.
  void setSigmaThreshold(double threshold)
  {
    sigma_threshold_ = threshold;
    Base::setDistanceThreshold(0.0);
  }

  /// The threshold in sigmas, set or by default; 0 where it is in metres
  /// (getDistanceThreshold()).
  double getSigmaThreshold() const
  {
    return isInMetres() ? 0.0 : sigma_threshold_.value_or(kDefaultSigmas);
  }

  /// Options that make no sense are refused with PCL_ERROR. Their `distance` is not
  /// used: the threshold has its own.
  void setOptions(const ConsensusOptions& options);

  const ConsensusOptions& getOptions() const
  {
    return options_;
  }

  /// Where PCL optimizes the coefficients once, here that goes on until the inliers
  /// stay the same. No inliers and no coefficients, and PCL_ERROR, where it fails.
  void segment(pcl::PointIndices& inliers,
               pcl::ModelCoefficients& model_coefficients) override;

  /// The patch of the last segment(): of its inliers and coefficients. Its status is
  /// TooFewPoints where there was none.
  const FitResult& getPatch() const
  {
    return patch_;
  }

  /// What went wrong or looks wrong in the last segment(), one line each: what was
  /// given, what was expected, the likely cause. Empty when all is well.
  const std::vector<std::string>& getNotices() const
  {
    return notices_;
  }

protected:
  using Base::indices_;
  using Base::input_;
  using Base::model_;
  using Base::model_type_;
  using Base::optimize_coefficients_;
  using Base::radius_max_;
  using Base::radius_min_;
  using Base::random_;
  using Base::threshold_;

  bool initSACModel(int model_type) override;

  std::string getClassName() const override
  {
    return "PatchSegmentation";
  }

private:
  using Model = SampleConsensusModelPatch<PointT>;

  static constexpr double kDefaultSigmas = 3.0;

  // Also where a pointer to the base was told, whose functions are not virtual.
  bool isInMetres() const
  {
    return threshold_ != 0.0;
  }

  void search(pcl::PointIndices& inliers, pcl::ModelCoefficients& model_coefficients);
  void finish(Model& model,
              pcl::PointIndices& inliers,
              pcl::ModelCoefficients& model_coefficients);
  void settle(Model& model, pcl::Indices& inliers, Eigen::VectorXf& coefficients) const;
  std::string misuse(const Model& model) const;
  void reportError(const std::string& error);
  void reportNotice(const std::string& notice);

  CovariancesConstPtr covariances_;
  Sensor sensor_; ///< of which the noise may be null
  std::optional<Pose> sensor_pose_;
  ConsensusOptions options_;
  FitResult patch_;
  ConsensusDistance unit_ = ConsensusDistance::Mahalanobis; ///< of this segment()
  std::optional<double> sigma_threshold_;
  std::vector<std::string> notices_;
  std::vector<std::string> earlier_notices_; ///< of the segment() before
};

} // namespace holdfast

#ifdef PCL_NO_PRECOMPILE
#include <holdfast/pcl/impl/patch_segmentation.hpp>
#endif
