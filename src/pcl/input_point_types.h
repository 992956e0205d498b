/// \file The point types our templates are compiled for.
#pragma once

#include <holdfast/pcl/point_types.h>

#define HOLDFAST_INPUT_POINT_TYPES                                      \
  (pcl::PointXYZ)(pcl::PointXYZI)(pcl::PointXYZRGB)(pcl::PointXYZRGBA)( \
      pcl::PointNormal)(holdfast::PointXYZCovariance)
