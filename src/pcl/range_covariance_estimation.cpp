#include <holdfast/pcl/range_covariance_estimation.h>

#include "point_gatherer.h"

#include <pcl/common/point_tests.h>

#include <algorithm>
#include <limits>

namespace holdfast {

Covariances
rangeCovariances(const RangeCloud& cloud,
                 const NoiseModel::ConstPtr& noise,
                 const pcl::Indices& indices)
{
  Covariances covariances(
      indices.size(),
      Eigen::Matrix3f::Constant(std::numeric_limits<float>::quiet_NaN()));
  std::vector<std::size_t> slots;
  for (std::size_t slot = 0; slot < indices.size(); ++slot)
    if (pcl::isFinite((*cloud.points)[indices[slot]]))
      slots.push_back(slot);

  constexpr std::size_t kBlock = 1024; // points, so that a batch stays in the cache
  const PointGatherer gatherer(cloud, noise, false);
  std::vector<int> block;
  PointBatch batch;
  for (std::size_t begin = 0; begin < slots.size(); begin += kBlock) {
    const std::size_t end = std::min(begin + kBlock, slots.size());
    block.clear();
    for (std::size_t i = begin; i < end; ++i)
      block.push_back(indices[slots[i]]);
    gatherer.gather(block, Eigen::Vector3d::Zero(), batch);
    for (std::size_t i = begin; i < end; ++i) {
      const Eigen::Matrix3d Sigma = batch.covariance(static_cast<int>(i - begin));
      if (Sigma.allFinite())
        covariances[slots[i]] = Sigma.cast<float>();
    }
  }
  return covariances;
}

} // namespace holdfast
