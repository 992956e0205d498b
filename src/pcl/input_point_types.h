/// \file The point types our templates are compiled for.
#pragma once

#include <holdfast/pcl/point_types.h>

// All but the plain one, which the program uses: sources that the quick start leaves
// out compile these.
#define HOLDFAST_OTHER_POINT_TYPES                                         \
  (pcl::PointXYZI)(pcl::PointXYZRGB)(pcl::PointXYZRGBA)(pcl::PointNormal)( \
      holdfast::PointXYZCovariance)
#define HOLDFAST_INPUT_POINT_TYPES (pcl::PointXYZ) HOLDFAST_OTHER_POINT_TYPES

// Each of these in a source of its own, further_*.cpp, which
// HOLDFAST_ONLY_CORE_POINT_TYPES leaves out.
#define HOLDFAST_FURTHER_POINT_TYPES \
  (pcl::PointXYZL)(pcl::PointXYZRGBL)(pcl::PointXYZINormal)(pcl::PointXYZRGBNormal)
