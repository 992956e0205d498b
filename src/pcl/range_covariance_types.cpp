#include "compiled_searches.h"
#include "input_point_types.h"

#include <holdfast/pcl/impl/range_covariance_estimation.hpp>

#include <pcl/impl/instantiate.hpp>

PCL_INSTANTIATE_PRODUCT(RangeCovarianceEstimation,
                        (HOLDFAST_INPUT_POINT_TYPES)((holdfast::PointXYZCovariance)))
