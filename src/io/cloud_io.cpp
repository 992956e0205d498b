#include "cloud_readers.h"

#include <holdfast/geometry/gaussian.h>
#include <holdfast/io/atomic_file.h>
#include <holdfast/pcl/intrinsics.h>

#include <pcl/common/point_tests.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <new>
#include <sstream>

namespace holdfast {
namespace {

enum class Format { Pcd, Ply, Png, Pgm, Unknown };

constexpr std::string_view kPngSignature("\x89PNG\r\n\x1a\n", 8);

bool
startsWith(std::string_view text, std::string_view start)
{
  return text.substr(0, start.size()) == start;
}

std::string
lowerExtension(const std::string& path)
{
  std::string extension = std::filesystem::path(path).extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(), [](char c) {
    return static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  });
  return extension;
}

Format
formatOfExtension(const std::string& path)
{
  const std::string extension = lowerExtension(path);
  return extension == ".pcd" ? Format::Pcd :
         extension == ".ply" ? Format::Ply :
         extension == ".png" ? Format::Png :
         extension == ".pgm" ? Format::Pgm :
                               Format::Unknown;
}

Format
detectFormat(std::string_view bytes, const std::string& path)
{
  if (startsWith(bytes, kPngSignature))
    return Format::Png;
  if (startsWith(bytes, "ply\n") || startsWith(bytes, "ply\r\n"))
    return Format::Ply;
  if (startsWith(bytes, "# .PCD") || startsWith(bytes, "VERSION"))
    return Format::Pcd;
  if (startsWith(bytes, "P5"))
    return Format::Pgm;
  return formatOfExtension(path);
}

std::string
readBytes(const std::string& path)
{
  std::error_code error;
  const auto status = std::filesystem::status(path, error);
  if (status.type() == std::filesystem::file_type::not_found)
    throw std::runtime_error("no such file");
  if (status.type() == std::filesystem::file_type::directory)
    throw std::runtime_error("is a directory, not a cloud");
  if (status.type() != std::filesystem::file_type::regular)
    throw std::runtime_error("is no regular file");
  std::ifstream file(path, std::ios::binary);
  if (!file)
    throw std::runtime_error("cannot be opened: " + std::string(std::strerror(errno)));
  std::string bytes(std::filesystem::file_size(path), '\0');
  if (bytes.empty())
    throw std::runtime_error("is empty");
  file.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  if (file.gcount() != static_cast<std::streamsize>(bytes.size()))
    throw std::runtime_error("could not be read completely");
  return bytes;
}

/// The camera for an image of another size but the same aspect ratio.
Camera
scaledCamera(const Camera& camera, int width, int height)
{
  if (static_cast<std::int64_t>(width) * camera.height !=
      static_cast<std::int64_t>(height) * camera.width)
    throw std::runtime_error(
        "an image of " + std::to_string(width) + " x " + std::to_string(height) +
        " pixels is not from a camera of " + std::to_string(camera.width) + " x " +
        std::to_string(camera.height));
  const double scale = static_cast<double>(width) / camera.width;
  Camera scaled;
  scaled.width = width;
  scaled.height = height;
  scaled.fx = scale * camera.fx;
  scaled.fy = scale * camera.fy;
  // Pixel coordinates are 0 at the centre of the first pixel, -0.5 at its edge.
  scaled.cx = scale * (camera.cx + 0.5) - 0.5;
  scaled.cy = scale * (camera.cy + 0.5) - 0.5;
  return scaled;
}

void
checkDepthRange(const io::DepthImage& image, const LoadOptions& options)
{
  const auto in_range = [&](std::uint16_t units) {
    const double depth = units / options.depth_scale;
    return units != 0 && depth >= options.min_range_m && depth <= options.max_range_m;
  };
  const auto measured = [](std::uint16_t units) { return units != 0; };
  if (std::none_of(image.pixels.begin(), image.pixels.end(), measured))
    throw std::runtime_error("has no valid point");
  if (std::none_of(image.pixels.begin(), image.pixels.end(), in_range))
    throw std::runtime_error("no depth is within the range of the sensor: is the depth "
                             "scale right?");
}

/// Back-projects the pixels; the cloud is in the camera frame.
io::RawCloud
backProject(const io::DepthImage& image,
            const LoadOptions& options,
            const std::string& format)
{
  if (image.pixels.empty())
    throw std::runtime_error("has no pixels");
  checkDepthRange(image, options);
  const Camera camera = scaledCamera(options.camera, image.width, image.height);
  io::RawCloud cloud;
  cloud.info.format = format;
  cloud.info.fields = {"depth"};
  if (camera.width != options.camera.width)
    cloud.info.notices.push_back("intrinsics scaled from " +
                                 std::to_string(options.camera.width) + " to " +
                                 std::to_string(camera.width) + " pixels of width");
  const float nan = std::numeric_limits<float>::quiet_NaN();
  cloud.points->reserve(image.pixels.size());
  for (int v = 0; v < image.height; ++v)
    for (int u = 0; u < image.width; ++u) {
      const std::size_t i = cloud.points->size();
      const double depth = image.pixels[i] / options.depth_scale;
      const Eigen::Vector3f q = camera.backProject(u, v, depth).cast<float>();
      cloud.points->push_back(depth > 0.0 ? pcl::PointXYZ(q.x(), q.y(), q.z()) :
                                            pcl::PointXYZ(nan, nan, nan));
    }
  cloud.points->width = static_cast<std::uint32_t>(image.width);
  cloud.points->height = static_cast<std::uint32_t>(image.height);
  return cloud;
}

io::RawCloud
readAny(const std::string& path, const LoadOptions& options)
{
  const std::string bytes = readBytes(path);
  switch (detectFormat(bytes, path)) {
  case Format::Pcd:
    return io::readPcd(bytes);
  case Format::Ply:
    return io::readPly(bytes);
  case Format::Png:
    return backProject(io::readPng(bytes), options, "PNG depth");
  case Format::Pgm:
    return backProject(io::readPgm(bytes), options, "PGM depth");
  case Format::Unknown:
    break;
  }
  throw std::runtime_error("is neither PCD, PLY, 16-bit PNG nor PGM");
}

/// Coordinates are kept in single precision.
void
noteCoarseCoordinates(io::RawCloud& cloud)
{
  float largest = 0.0F;
  for (const auto& point : *cloud.points)
    if (pcl::isFinite(point))
      largest = std::max(largest, point.getArray3fMap().abs().maxCoeff());
  const double step_m = std::ldexp(largest, -23);
  if (step_m < 1e-4)
    return;
  char line[120];
  std::snprintf(line,
                sizeof(line),
                "coordinates up to %.0f m are only kept to %.1g m: move the cloud "
                "towards the origin",
                static_cast<double>(largest),
                step_m);
  cloud.info.notices.emplace_back(line);
}

RangeCloud
finish(io::RawCloud& raw)
{
  auto& points = *raw.points;
  RangeCloud cloud;
  cloud.points = raw.points;
  cloud.covariances = std::move(raw.covariances);
  const int valid = countValidPoints(cloud);
  if (valid == 0)
    throw std::runtime_error("has no valid point");
  points.is_dense = static_cast<std::size_t>(valid) == points.size();
  std::string notice;
  cloud.sensor_pose =
      chooseSensorPose(cloud.points, raw.info.viewpoint.value_or(Pose()), &notice);
  if (!notice.empty())
    raw.info.notices.push_back(notice);
  noteCoarseCoordinates(raw);
  return cloud;
}

std::string
pcdHeader(const RangeCloud& cloud, bool ascii)
{
  const bool has_covariances = !cloud.covariances.empty();
  const Eigen::Vector3d& c = cloud.sensor_pose.c;
  const Eigen::Quaterniond q(cloud.sensor_pose.R);
  std::ostringstream header;
  header.precision(9);
  header << "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\n"
         << (has_covariances ? "FIELDS x y z covariance\nSIZE 4 4 4 4\nTYPE F F F F\n"
                               "COUNT 1 1 1 6\n" :
                               "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\n")
         << "WIDTH " << cloud.points->width << "\nHEIGHT " << cloud.points->height
         << "\nVIEWPOINT " << c.x() << ' ' << c.y() << ' ' << c.z() << ' ' << q.w()
         << ' ' << q.x() << ' ' << q.y() << ' ' << q.z() << "\nPOINTS "
         << cloud.points->size() << "\nDATA " << (ascii ? "ascii\n" : "binary\n");
  return header.str();
}

/// x y z, then xx xy xz yy yz zz when there are covariances.
std::vector<float>
pcdRow(const RangeCloud& cloud, std::size_t i)
{
  const pcl::PointXYZ& p = (*cloud.points)[i];
  if (cloud.covariances.empty())
    return {p.x, p.y, p.z};
  const Eigen::Matrix3f& s = cloud.covariances[i];
  return {p.x, p.y, p.z, s(0, 0), s(0, 1), s(0, 2), s(1, 1), s(1, 2), s(2, 2)};
}

} // namespace

RangeCloud
loadCloud(const std::string& path, const LoadOptions& options, CloudFileInfo* info)
{
  if (!(options.depth_scale > 0.0) || !std::isfinite(options.depth_scale))
    throw std::invalid_argument("the depth scale must be a positive number");
  try {
    io::RawCloud raw = readAny(path, options);
    RangeCloud cloud = finish(raw);
    if (info != nullptr)
      *info = std::move(raw.info);
    return cloud;
  }
  catch (const std::runtime_error& error) {
    throw std::runtime_error(path + ": " + error.what());
  }
  catch (const std::bad_alloc&) {
    throw std::runtime_error(path + ": is too large for the memory");
  }
}

void
saveCloud(const std::string& path, const RangeCloud& cloud, bool ascii)
{
  if (const std::string error = validityError(cloud); !error.empty())
    throw std::invalid_argument(error);
  AtomicFile file(path);
  std::ostream& out = file.stream();
  out << pcdHeader(cloud, ascii);
  out.precision(9);
  for (std::size_t i = 0; i < cloud.points->size(); ++i) {
    const std::vector<float> row = pcdRow(cloud, i);
    if (!ascii) {
      out.write(reinterpret_cast<const char*>(row.data()),
                static_cast<std::streamsize>(row.size() * sizeof(float)));
      continue;
    }
    for (std::size_t k = 0; k < row.size(); ++k)
      out << (k == 0 ? "" : " ") << row[k];
    out << '\n';
  }
  file.commit();
}

bool
isCloudFile(const std::string& path)
{
  // NAME.patches.ply, NAME.patches.pcd
  if (std::filesystem::path(path).stem().extension() == ".patches")
    return false;
  const Format format = formatOfExtension(path);
  if (format != Format::Png && format != Format::Pgm)
    return format != Format::Unknown;
  std::array<char, 64> start{};
  std::ifstream(path, std::ios::binary).read(start.data(), start.size());
  const std::string_view bytes(start.data(), start.size());
  // Bit depth and colour type of a PNG; files that are no images at all are left to the
  // reader, which says what is wrong with them.
  if (format == Format::Png)
    return !startsWith(bytes, kPngSignature) || (bytes[24] == 16 && bytes[25] == 0);
  return true;
}

int
countValidPoints(const RangeCloud& cloud)
{
  return static_cast<int>(
      std::count_if(cloud.points->begin(), cloud.points->end(), [](const auto& point) {
        return pcl::isFinite(point);
      }));
}

int
countInvalidCovariances(const RangeCloud& cloud)
{
  int invalid = 0;
  for (std::size_t i = 0; i < cloud.covariances.size(); ++i)
    invalid += pcl::isFinite((*cloud.points)[i]) &&
               !isPositiveSemiDefinite(cloud.covariances[i].cast<double>());
  return invalid;
}

} // namespace holdfast
