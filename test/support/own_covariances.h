#pragma once

#include <holdfast/pcl/range_cloud.h>

#include <memory>

namespace holdfast::test {

/// Covariances of a cloud that may be changed: no copy of the cloud shares them.
inline Covariances&
ownCovariances(RangeCloud& cloud)
{
  const auto own = cloud.covariances ?
                       std::make_shared<Covariances>(*cloud.covariances) :
                       std::make_shared<Covariances>();
  cloud.covariances = own;
  return *own;
}

} // namespace holdfast::test
