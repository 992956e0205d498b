/// \file PCD files of any point type. By code of our own: libpcl_io would bring VTK
/// into every process.
#pragma once

#include <pcl/PCLPointCloud2.h>

#include <Eigen/Geometry>

#include <ostream>

namespace holdfast::io {

/// Writes the cloud, unorganized or not, as a binary_compressed PCD with the sensor
/// pose as VIEWPOINT. Fields follow each other without gaps, as all do that
/// pcl::toPCLPointCloud2 makes.
/// \throw std::length_error when its data are more than the format can hold, 4 GiB.
void writePcdCompressed(std::ostream& out,
                        const pcl::PCLPointCloud2& cloud,
                        const Eigen::Vector4f& position,
                        const Eigen::Quaternionf& orientation);

} // namespace holdfast::io
