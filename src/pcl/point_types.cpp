// What PCL compiles for its own point types, for ours: a program that only includes
// PCL's headers links.
#include <holdfast/pcl/foothold_point.h>
#include <holdfast/pcl/point_types.h>

#include <pcl/filters/impl/extract_indices.hpp>
#include <pcl/filters/impl/filter.hpp>
#include <pcl/filters/impl/filter_indices.hpp>
#include <pcl/filters/impl/passthrough.hpp>
#include <pcl/filters/impl/voxel_grid.hpp>
#include <pcl/impl/instantiate.hpp>
#include <pcl/impl/pcl_base.hpp>
#include <pcl/kdtree/impl/kdtree_flann.hpp>
#include <pcl/sample_consensus/impl/ransac.hpp>
#include <pcl/search/impl/kdtree.hpp>
#include <pcl/search/impl/organized.hpp>
#include <pcl/search/impl/search.hpp>

#define HOLDFAST_POINT_TYPES \
  (holdfast::PointXYZCovariance)(holdfast::PatchPoint)(holdfast::FootholdPoint)

PCL_INSTANTIATE(PCLBase, HOLDFAST_POINT_TYPES)
PCL_INSTANTIATE(KdTreeFLANN, HOLDFAST_POINT_TYPES)
PCL_INSTANTIATE(Search, HOLDFAST_POINT_TYPES)
PCL_INSTANTIATE(KdTree, HOLDFAST_POINT_TYPES)
PCL_INSTANTIATE(OrganizedNeighbor, HOLDFAST_POINT_TYPES)
PCL_INSTANTIATE(removeNanFromPointCloud, HOLDFAST_POINT_TYPES)
PCL_INSTANTIATE(removeNaNFromPointCloud, HOLDFAST_POINT_TYPES)
PCL_INSTANTIATE(FilterIndices, HOLDFAST_POINT_TYPES)
PCL_INSTANTIATE(PassThrough, HOLDFAST_POINT_TYPES)
PCL_INSTANTIATE(ExtractIndices, HOLDFAST_POINT_TYPES)

// The mean of patches is no patch, nor is there a model of them.
PCL_INSTANTIATE(VoxelGrid, (holdfast::PointXYZCovariance))
PCL_INSTANTIATE(RandomSampleConsensus, (holdfast::PointXYZCovariance))
