#include <holdfast/pcl/impl/patch_segmentation.hpp>

#include <pcl/impl/instantiate.hpp>

PCL_INSTANTIATE(PatchSegmentation,
                (pcl::PointXYZ)(pcl::PointXYZI)(pcl::PointXYZRGB)(pcl::PointXYZRGBA)(
                    pcl::PointNormal))
