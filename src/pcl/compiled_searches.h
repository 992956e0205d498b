/// \file Searches that are compiled elsewhere.
///
/// The sources of the library include this before the implementation of a class that
/// searches; else each would compile FLANN's trees again for every point type.
#pragma once

#include "input_point_types.h"

#include <boost/preprocessor/seq/for_each.hpp>
#include <pcl/kdtree/kdtree_flann.h>
#include <pcl/search/kdtree.h>
#include <pcl/search/organized.h>

// PCL's own types in its libraries, ours in point_types.cpp.
#define HOLDFAST_COMPILED_SEARCH(r, data, PointT)    \
  extern template class pcl::KdTreeFLANN<PointT>;    \
  extern template class pcl::search::Search<PointT>; \
  extern template class pcl::search::KdTree<PointT>; \
  extern template class pcl::search::OrganizedNeighbor<PointT>;

BOOST_PP_SEQ_FOR_EACH(HOLDFAST_COMPILED_SEARCH,
                      ,
                      HOLDFAST_INPUT_POINT_TYPES HOLDFAST_FURTHER_POINT_TYPES)

#undef HOLDFAST_COMPILED_SEARCH
