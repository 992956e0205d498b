#include "pcd_writer.h"

#include "lzf.h"

#include <pcl/common/io.h>

#include <algorithm>
#include <cstdint>
#include <iterator>
#include <stdexcept>
#include <string>

#include <fmt/format.h>

namespace holdfast::io {
namespace {

std::size_t
bytesOf(const pcl::PCLPointField& field)
{
  // A count of 0 is one value, from the first days of PCL.
  return static_cast<std::size_t>(pcl::getFieldSize(field.datatype)) *
         std::max(1U, field.count);
}

std::string
headerOf(const pcl::PCLPointCloud2& cloud,
         const Eigen::Vector4f& position,
         const Eigen::Quaternionf& orientation)
{
  std::string names = "FIELDS", sizes = "SIZE", types = "TYPE", counts = "COUNT";
  for (const pcl::PCLPointField& field : cloud.fields) {
    names += ' ' + field.name;
    fmt::format_to(std::back_inserter(sizes), " {}", pcl::getFieldSize(field.datatype));
    fmt::format_to(std::back_inserter(types), " {}", pcl::getFieldType(field.datatype));
    fmt::format_to(std::back_inserter(counts), " {}", std::max(1U, field.count));
  }
  return fmt::format("# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\n"
                     "{}\n{}\n{}\n{}\nWIDTH {}\nHEIGHT {}\n"
                     "VIEWPOINT {} {} {} {} {} {} {}\nPOINTS {}\n"
                     "DATA binary_compressed\n",
                     names,
                     sizes,
                     types,
                     counts,
                     cloud.width,
                     cloud.height,
                     position.x(),
                     position.y(),
                     position.z(),
                     orientation.w(),
                     orientation.x(),
                     orientation.y(),
                     orientation.z(),
                     std::size_t{cloud.width} * cloud.height);
}

/// All values of the first field, then all of the second, and so on.
std::string
fieldByField(const pcl::PCLPointCloud2& cloud)
{
  std::string plain;
  for (const pcl::PCLPointField& field : cloud.fields) {
    const std::size_t size = bytesOf(field);
    for (std::size_t at = field.offset; at < cloud.data.size(); at += cloud.point_step)
      plain.append(reinterpret_cast<const char*>(&cloud.data[at]), size);
  }
  return plain;
}

void
writeWord(std::ostream& out, std::size_t value)
{
  if (value > UINT32_MAX)
    throw std::length_error("more data than a compressed PCD can hold");
  const auto word = static_cast<std::uint32_t>(value);
  out.write(reinterpret_cast<const char*>(&word), sizeof(word));
}

} // namespace

void
writePcdCompressed(std::ostream& out,
                   const pcl::PCLPointCloud2& cloud,
                   const Eigen::Vector4f& position,
                   const Eigen::Quaternionf& orientation)
{
  const std::string plain = fieldByField(cloud);
  const std::string packed = lzfCompress(plain);
  out << headerOf(cloud, position, orientation);
  writeWord(out, packed.size());
  writeWord(out, plain.size());
  out << packed;
}

} // namespace holdfast::io
