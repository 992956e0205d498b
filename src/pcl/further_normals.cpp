#include "compiled_searches.h"
#include "input_point_types.h"

#include <holdfast/pcl/impl/patch_estimation.hpp>

#include <pcl/impl/instantiate.hpp>

PCL_INSTANTIATE_PRODUCT(PatchEstimation,
                        ((pcl::PointXYZ)(pcl::PointXYZRGB))((pcl::PointNormal)))
