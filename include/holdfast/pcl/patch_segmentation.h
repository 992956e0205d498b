/// \file Segmentation of one patch by sample consensus, in one class.
#pragma once

#include <holdfast/pcl/sac_model_patch.h>

#include <pcl/segmentation/sac_segmentation.h>

#include <optional>
#include <string>

namespace holdfast {

/// pcl::SACSegmentation with our models: the noise of every point decides what an
/// inlier is, and the result is a bounded patch with covariance.
///
///   PatchSegmentation<pcl::PointXYZ> segmentation;
///   segmentation.setInputCloud(cloud);
///   segmentation.setSensor(loadSensor("kinect_v1"));
///   segmentation.setModelType(pcl::SACMODEL_CYLINDER);
///   segmentation.setMethodType(pcl::SAC_RANSAC);
///   segmentation.setDistanceThreshold(3.0); // sigmas
///   segmentation.setMaxIterations(1000);
///   segmentation.segment(inliers, coefficients);
///   if (!inliers.indices.empty())
///     use(segmentation.getPatch());
///
/// Model types are SACMODEL_PLANE, SACMODEL_SPHERE and SACMODEL_CYLINDER (which needs
/// no normals here), and those of PatchSacModel; any other is left to PCL and yields no
/// patch. Coefficients, noise, distances and the remarks on PCL's methods: see
/// SampleConsensusModelPatch. PCL's limit of 50 iterations suits planes only.
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

  void setNoiseModel(const NoiseModel::ConstPtr& noise)
  {
    noise_ = noise;
  }

  void setSensor(const Sensor& sensor)
  {
    setNoiseModel(sensor.noise);
  }

  /// See SampleConsensusModelPatch::setSensorPose().
  void setSensorPose(const std::optional<Pose>& pose)
  {
    sensor_pose_ = pose;
  }

  /// Options that make no sense are refused with PCL_ERROR.
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

protected:
  using Base::indices_;
  using Base::input_;
  using Base::model_;
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
  void settle(SampleConsensusModelPatch<PointT>& model,
              pcl::Indices& inliers,
              Eigen::VectorXf& coefficients) const;

  CovariancesConstPtr covariances_;
  NoiseModel::ConstPtr noise_;
  std::optional<Pose> sensor_pose_;
  ConsensusOptions options_;
  FitResult patch_;
};

} // namespace holdfast

#ifdef PCL_NO_PRECOMPILE
#include <holdfast/pcl/impl/patch_segmentation.hpp>
#endif
