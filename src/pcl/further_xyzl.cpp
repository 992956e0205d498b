#include "further_types.h"

HOLDFAST_INSTANTIATE_ALL(pcl::PointXYZL)
