/// \file Our templates for one point type, in a source of its own.
#pragma once

#include "compiled_searches.h"

#include <holdfast/pcl/impl/patch_estimation.hpp>
#include <holdfast/pcl/impl/patch_segmentation.hpp>
#include <holdfast/pcl/impl/range_covariance_estimation.hpp>

#define HOLDFAST_INSTANTIATE_ALL(PointT)                                              \
  template class PCL_EXPORTS holdfast::PatchEstimation<PointT, holdfast::PatchPoint>; \
  template class PCL_EXPORTS                                                          \
      holdfast::RangeCovarianceEstimation<PointT, holdfast::PointXYZCovariance>;      \
  template class PCL_EXPORTS holdfast::SampleConsensusModelPatch<PointT>;             \
  template class PCL_EXPORTS holdfast::PatchSegmentation<PointT>;
