#include "pcd_writer.h"

#include <holdfast/io/patch_io.h>
#include <holdfast/patch/tessellation.h>
#include <holdfast/pcl/conversions.h>

#include <fmt/format.h>

#include <pcl/conversions.h>

#include <array>
#include <cstdint>

namespace holdfast {
namespace {

/// All meshes as one.
struct ColoredMesh {
  std::vector<Eigen::Vector3d> vertices;
  std::vector<std::array<std::uint8_t, 3>> colors; ///< one per vertex
  std::vector<std::array<std::int32_t, 3>> triangles;
};

std::array<std::uint8_t, 3>
shadedColor(const ExtractedPatch& extracted)
{
  std::array<std::uint8_t, 3> color = surfaceColor(extracted.fit.patch.type.surface);
  if (extracted.validation)
    for (std::uint8_t& channel : color)
      channel = static_cast<std::uint8_t>(
          0.5 * (1.0 + extracted.validation->coverage.share) * channel);
  return color;
}

ColoredMesh
meshOf(const std::vector<ExtractedPatch>& patches, const Eigen::Vector3d& offset)
{
  ColoredMesh all;
  for (const ExtractedPatch& extracted : patches) {
    const Patch& patch = extracted.fit.patch;
    // Bounds are half-lengths; gamma, the last of the five, is an angle.
    const double length = 2.0 * patch.d.head<4>().maxCoeff();
    const Mesh mesh = tessellate(patch, length / 8.0);
    const auto first = static_cast<std::int32_t>(all.vertices.size());
    for (const Eigen::Vector3d& vertex : mesh.vertices)
      all.vertices.push_back(vertex + offset);
    all.colors.resize(all.vertices.size(), shadedColor(extracted));
    for (const auto& t : mesh.triangles)
      all.triangles.push_back({first + t[0], first + t[1], first + t[2]});
  }
  return all;
}

template <typename T>
void
writeRaw(std::ostream& out, const T* values, std::size_t n)
{
  out.write(reinterpret_cast<const char*>(values),
            static_cast<std::streamsize>(n * sizeof(T)));
}

void
writeMeshText(std::ostream& out, const ColoredMesh& mesh, bool in_double)
{
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    const Eigen::Vector3d& vertex = mesh.vertices[i];
    const Eigen::Vector3d v =
        in_double ? vertex : vertex.cast<float>().cast<double>().eval();
    const auto& color = mesh.colors[i];
    // Digits that give the value back in the precision it is read with.
    const int digits = in_double ? 17 : 9;
    out << fmt::format("{:.{}g} {:.{}g} {:.{}g} {} {} {}\n",
                       v.x(),
                       digits,
                       v.y(),
                       digits,
                       v.z(),
                       digits,
                       color[0],
                       color[1],
                       color[2]);
  }
  for (const auto& t : mesh.triangles)
    out << fmt::format("3 {} {} {}\n", t[0], t[1], t[2]);
}

void
writeMeshBinary(std::ostream& out, const ColoredMesh& mesh, bool in_double)
{
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    const Eigen::Vector3f single = mesh.vertices[i].cast<float>();
    if (in_double)
      writeRaw(out, mesh.vertices[i].data(), 3);
    else
      writeRaw(out, single.data(), 3);
    writeRaw(out, mesh.colors[i].data(), 3);
  }
  for (const auto& t : mesh.triangles) {
    out.put('\3');
    writeRaw(out, t.data(), 3);
  }
}

} // namespace

void
writeMesh(std::ostream& out,
          const std::vector<ExtractedPatch>& patches,
          bool ascii,
          const Eigen::Vector3d& offset)
{
  const ColoredMesh mesh = meshOf(patches, offset);
  // What was shifted to fit into float does not fit into it.
  const bool in_double = !offset.isZero(0.0);
  out << fmt::format(
      "ply\nformat {0} 1.0\ncomment bounded patches, coloured by surface type\n"
      "element vertex {1}\nproperty {3} x\nproperty {3} y\nproperty {3} z\n"
      "property uchar red\nproperty uchar green\nproperty uchar blue\n"
      "element face {2}\nproperty list uchar int vertex_indices\nend_header\n",
      ascii ? "ascii" : "binary_little_endian",
      mesh.vertices.size(),
      mesh.triangles.size(),
      in_double ? "double" : "float");
  if (ascii)
    writeMeshText(out, mesh, in_double);
  else
    writeMeshBinary(out, mesh, in_double);
}

namespace {

void
writePatchCloud(std::ostream& out,
                const pcl::PointCloud<PatchPoint>& cloud,
                const Eigen::Vector3d& offset)
{
  pcl::PCLPointCloud2 fields;
  pcl::toPCLPointCloud2(cloud, fields);
  if (!offset.isZero(0.0))
    out << fmt::format("# add {} {} {} m to x y z: single precision cannot hold them\n",
                       offset.x(),
                       offset.y(),
                       offset.z());
  io::writePcdCompressed(out, fields, cloud.sensor_origin_, cloud.sensor_orientation_);
}

} // namespace

void
writePatchPoints(std::ostream& out,
                 const std::vector<ExtractedPatch>& patches,
                 const Pose& sensor_pose,
                 const Eigen::Vector3d& offset)
{
  writePatchCloud(out, toPatchCloud(patches, sensor_pose), offset);
}

void
writePatchPoints(std::ostream& out,
                 const DenseExtraction& dense,
                 const Pose& sensor_pose,
                 const Eigen::Vector3d& offset)
{
  writePatchCloud(out, toPatchCloud(dense, sensor_pose), offset);
}

std::array<std::uint8_t, 3>
surfaceColor(SurfaceType surface)
{
  // Okabe and Ito's palette, which colour-blind people can tell apart; in the order of
  // SurfaceType.
  using Color = std::array<std::uint8_t, 3>;
  constexpr std::array kColors{Color{153, 153, 153},
                               Color{240, 228, 66},
                               Color{204, 121, 167},
                               Color{0, 114, 178},
                               Color{213, 94, 0},
                               Color{0, 158, 115},
                               Color{86, 180, 233}};
  static_assert(kColors.size() == kSurfaceTraits.size(), "every surface has a colour");
  return kColors.at(static_cast<std::size_t>(surface));
}

} // namespace holdfast
