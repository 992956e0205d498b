#include "risk/risk_layers.h"

#include "io/pcd_writer.h"
#include "render/risk_colors.h"

#include <holdfast/io/atomic_file.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <stdexcept>
#include <vector>

namespace holdfast::app {
namespace {

std::string
endingOf(const std::string& path)
{
  return std::filesystem::path(path).extension().string();
}

Canvas
pictureOf(const RiskGrid& grid)
{
  constexpr Rgb kNothing{255, 255, 255};
  constexpr int kLeast = 600, kMost = 4096, kLargestCell = 12; // px
  const int longest = std::max(grid.rows, grid.columns);
  if (longest > kMost)
    throw std::runtime_error("a picture has at most 4096 cells a side; take a larger "
                             "--resolution, or *.pcd or *.tif");
  const int cell = std::clamp(kLeast / longest, 1, kLargestCell);
  Canvas canvas(cell * grid.columns, cell * grid.rows, kNothing);
  for (int row = 0; row < grid.rows; ++row)
    for (int column = 0; column < grid.columns; ++column) {
      if (std::isnan(grid.at(RiskLayer::Elevation, row, column)))
        continue;
      const auto total =
          static_cast<double>(grid.at(RiskLayer::RiskTotal, row, column));
      canvas.drawRectangle(
          {cell * column, cell * row, cell * (column + 1), cell * (row + 1)},
          std::isnan(total) ? kNoSupport : riskColor(total));
    }
  return canvas;
}

void
addField(pcl::PCLPointCloud2& cloud, const std::string& name)
{
  pcl::PCLPointField field;
  field.name = name;
  field.offset = cloud.point_step;
  field.datatype = pcl::PCLPointField::FLOAT32;
  field.count = 1;
  cloud.fields.push_back(field);
  cloud.point_step += sizeof(float);
}

void
writePcd(std::ostream& out, const RiskGrid& grid, const Eigen::Vector3d& offset)
{
  pcl::PCLPointCloud2 cloud;
  for (const char* name : {"x", "y", "z"})
    addField(cloud, name);
  for (const std::string& layer : grid.layers)
    addField(cloud, layer);
  cloud.width = static_cast<std::uint32_t>(grid.rows);
  cloud.height = static_cast<std::uint32_t>(grid.columns);
  cloud.row_step = cloud.point_step * cloud.width;
  cloud.is_dense = 0;
  cloud.data.resize(static_cast<std::size_t>(cloud.row_step) * cloud.height);
  std::uint8_t* to = cloud.data.data();
  const auto put = [&](float value) {
    std::memcpy(to, &value, sizeof value);
    to += sizeof value;
  };
  for (int column = 0; column < grid.columns; ++column)
    for (int row = 0; row < grid.rows; ++row) {
      const Eigen::Vector3f point = (grid.point(row, column) + offset).cast<float>();
      for (const float coordinate : point)
        put(coordinate);
      for (int layer = 0; layer < static_cast<int>(grid.layers.size()); ++layer)
        put(grid.at(static_cast<RiskLayer>(layer), row, column));
    }
  io::writePcdCompressed(out,
                         cloud,
                         Eigen::Vector4f::Zero(),
                         Eigen::Quaternionf::Identity());
}

/// Little-endian, whatever the machine is.
void
appendBytes(std::string& bytes, std::uint32_t value, int count)
{
  for (int i = 0; i < count; ++i)
    bytes += static_cast<char>(value >> (8 * i) & 0xFFU);
}

/// A page of a TIFF: its values, its name, and the directory behind them.
/// \param start of the page in the file; \param is_last no other follows
std::string
tiffPage(const RiskGrid& grid, int layer, std::uint32_t start, bool is_last)
{
  enum Type : std::uint32_t { Ascii = 2, Short = 3, Long = 4 };
  std::string page;
  for (int row = 0; row < grid.rows; ++row)
    for (int column = 0; column < grid.columns; ++column) {
      const float value = grid.at(static_cast<RiskLayer>(layer), row, column);
      std::uint32_t bits = 0;
      std::memcpy(&bits, &value, sizeof bits);
      appendBytes(page, bits, 4);
    }
  const auto size = static_cast<std::uint32_t>(page.size());
  std::string name = grid.layers[static_cast<std::size_t>(layer)];
  const auto letters = static_cast<std::uint32_t>(name.size()) + 1; // with an end
  name.resize((name.size() + 4) / 4 * 4, '\0'); // whole words
  const auto width = static_cast<std::uint32_t>(grid.columns);
  const auto height = static_cast<std::uint32_t>(grid.rows);
  const std::vector<std::array<std::uint32_t, 4>> entries{
      {254, Long, 1, 2}, // a page of several
      {256, Long, 1, width},
      {257, Long, 1, height},
      {258, Short, 1, 32}, // bits
      {259, Short, 1, 1}, // not compressed
      {262, Short, 1, 1}, // black is zero
      {270, Ascii, letters, start + size},
      {273, Long, 1, start}, // of its only strip
      {277, Short, 1, 1}, // samples
      {278, Long, 1, height},
      {279, Long, 1, size},
      {339, Short, 1, 3}}; // floats
  page += name;
  appendBytes(page, static_cast<std::uint32_t>(entries.size()), 2);
  for (const auto& [tag, type, count, value] : entries) {
    appendBytes(page, tag, 2);
    appendBytes(page, type, 2);
    appendBytes(page, count, 4);
    appendBytes(page, value, 4);
  }
  // Where the next page's directory is: behind as many bytes again, and its own name.
  std::uint32_t next = 0;
  if (!is_last) {
    const std::string& other = grid.layers[static_cast<std::size_t>(layer) + 1];
    const auto end = start + static_cast<std::uint32_t>(page.size()) + 4 + 2;
    next = end + size + static_cast<std::uint32_t>((other.size() + 4) / 4 * 4);
  }
  appendBytes(page, next, 4);
  appendBytes(page, 0, 2); // pages begin at whole words
  return page;
}

} // namespace

bool
isLayerFile(const std::string& path)
{
  const std::string ending = endingOf(path);
  return ending == ".png" || ending == ".pcd" || ending == ".tif";
}

void
writeTiff(std::ostream& out, const RiskGrid& grid)
{
  const auto layers = static_cast<int>(grid.layers.size());
  const double size = 4.0 * grid.rows * grid.columns;
  constexpr double kMost = 4e9; // offsets have 32 bits
  if (layers * (size + 1024.0) > kMost)
    throw std::runtime_error("more than a TIFF can hold; take a larger --resolution");
  std::string head = "II";
  appendBytes(head, 42, 2);
  const std::uint32_t first = 8; // the head's size
  const std::string& name = grid.layers.front();
  appendBytes(head,
              first + static_cast<std::uint32_t>(size) +
                  static_cast<std::uint32_t>((name.size() + 4) / 4 * 4),
              4);
  out << head;
  std::uint32_t start = first;
  for (int layer = 0; layer < layers; ++layer) {
    const std::string page = tiffPage(grid, layer, start, layer + 1 == layers);
    out.write(page.data(), static_cast<std::streamsize>(page.size()));
    start += static_cast<std::uint32_t>(page.size());
  }
}

void
writeLayers(const std::string& path,
            const RiskGrid& grid,
            const Eigen::Vector3d& offset)
{
  if (grid.rows == 0 || grid.columns == 0)
    throw std::runtime_error(path + ": the grid has no cell: nothing was seen");
  AtomicFile file(path);
  try {
    if (endingOf(path) == ".png")
      pictureOf(grid).writePng(file.stream());
    else if (endingOf(path) == ".pcd")
      writePcd(file.stream(), grid, offset);
    else
      writeTiff(file.stream(), grid);
  }
  catch (const std::exception& error) {
    throw std::runtime_error(path + ": " + error.what());
  }
  file.commit();
}

} // namespace holdfast::app
