#include "cloud_readers.h"
#include "file_bytes.h"
#include "pcl/zero_points.h"

#include <holdfast/geometry/gaussian.h>
#include <holdfast/io/atomic_file.h>
#include <holdfast/pcl/intrinsics.h>

#include <pcl/common/point_tests.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <memory>
#include <new>

#include <fmt/format.h>

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

/// True when the first line is "ply", with blanks behind it or not.
bool
isPly(std::string_view text)
{
  return startsWith(text, "ply") && text.size() > 3 &&
         std::string_view(" \t\r\n").find(text[3]) != std::string_view::npos;
}

/// True when the first line is at least three numbers.
bool
isTable(std::string_view text)
{
  constexpr std::size_t kLongest = 256; // of a line that is looked at
  text = text.substr(0, kLongest);
  std::string line(text.substr(0, text.find_first_of("\r\n")));
  for (char& c : line)
    if (c == ',' || c == ';' || c == '\t')
      c = ' ';
  int numbers = 0;
  for (std::size_t at = 0, end; at < line.size(); at = end + 1) {
    end = std::min(line.find(' ', at), line.size());
    if (end == at)
      continue;
    if (!io::parseNumber(std::string_view(line).substr(at, end - at)))
      return false;
    ++numbers;
  }
  return numbers >= 3;
}

/// What text that is no cloud is.
std::string_view
nameOfOtherText(std::string_view bytes)
{
  const std::string_view text = io::skipToText(bytes);
  if (startsWith(text, "{") || startsWith(text, "["))
    return ", but JSON";
  if (startsWith(text, "solid "))
    return ", but STL: convert it to PLY";
  for (const std::string_view start : {"v ", "o ", "g ", "mtllib "})
    if (startsWith(text, start))
      return ", but OBJ: convert it to PLY";
  if (isTable(text))
    return ", but a table of numbers: it wants the header of a PCD file";
  return "";
}

Format
detectFormat(std::string_view bytes, const std::string& path)
{
  if (startsWith(bytes, kPngSignature))
    return Format::Png;
  if (startsWith(bytes, "P5") || startsWith(bytes, "P2"))
    return Format::Pgm;
  const std::string_view text = io::skipToText(bytes);
  if (isPly(text))
    return Format::Ply;
  for (const std::string_view start :
       {"# .PCD", "VERSION ", "VERSION\t", "FIELDS ", "COLUMNS "})
    if (startsWith(text, start))
      return Format::Pcd;
  return nameOfOtherText(bytes).empty() ? formatOfExtension(path) : Format::Unknown;
}

/// What else is often found where a cloud is expected.
std::optional<std::string_view>
nameOfOtherData(std::string_view bytes)
{
  using namespace std::string_view_literals;
  struct Other {
    std::string_view start, name;
  };
  static constexpr Other kOthers[]{
      {"\xff\xd8\xff"sv, "a JPEG image, not a cloud"},
      {"LASF"sv, "a LAS or LAZ file: convert it to PCD or PLY"},
      {"ASTM-E57"sv, "an E57 file: convert it to PCD or PLY"},
      {"#ROSBAG"sv, "a ROS bag: save a cloud of it as PCD"},
      {"PCLZF"sv, "a PCLZF image: convert it to PNG"},
      {"II*\0"sv, "a TIFF image: convert it to PNG of 16 bits"},
      {"MM\0*"sv, "a TIFF image: convert it to PNG of 16 bits"},
      {"\x76\x2f\x31\x01"sv, "an OpenEXR image: convert it to PNG of 16 bits"},
      {"Pf\n"sv, "a PFM image: convert it to PNG of 16 bits"},
      {"P6"sv, "a colour image, not a cloud"},
      {"\x93NUMPY"sv, "a NumPy array: the Python module's extract() takes such"},
      {"\x89HDF\r\n"sv, "an HDF5 file: convert it to PCD or PLY"},
  };
  for (const Other& other : kOthers)
    if (startsWith(bytes, other.start))
      return other.name;
  return io::nameOfStranger(bytes);
}

io::RawCloud
readDepthImage(io::DepthImage image,
               const LoadOptions& options,
               const std::string& format)
{
  io::RawCloud cloud = io::backProject(image, options);
  cloud.info.format = format;
  return cloud;
}

io::RawCloud
readAny(const std::string& path, const LoadOptions& options)
{
  const io::FileBytes content = io::readBytes(path, "a cloud");
  const std::string_view bytes = content.view();
  if (const auto name = nameOfOtherData(bytes))
    throw std::runtime_error("is " + std::string(*name));
  switch (detectFormat(bytes, path)) {
  case Format::Pcd:
    return io::readPcd(bytes, options);
  case Format::Ply:
    return io::readPly(bytes, options);
  case Format::Png:
    return readDepthImage(io::readPng(bytes, options.max_points), options, "PNG depth");
  case Format::Pgm:
    return readDepthImage(io::readPgm(bytes, options.max_points), options, "PGM depth");
  case Format::Unknown:
    break;
  }
  throw std::runtime_error("is neither PCD, PLY, 16-bit PNG nor PGM" +
                           std::string(nameOfOtherText(bytes)));
}

/// What one look at all points tells.
struct PointSurvey {
  std::size_t finite = 0;
  std::size_t zeros = 0; ///< of those, the ones at 0 0 0
  float largest = 0.0F; ///< magnitude of a finite coordinate
};

/// Point by point.
void
surveyAny(pcl::PointXYZ* points, std::size_t n, PointSurvey& survey)
{
  constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
  for (pcl::PointXYZ* p = points; p != points + n; ++p) {
    if (!pcl::isFinite(*p)) {
      p->x = p->y = p->z = kNaN;
      continue;
    }
    ++survey.finite;
    survey.zeros += p->z == 0.0F && p->x == 0.0F && p->y == 0.0F;
    survey.largest = std::max(survey.largest, p->getArray3fMap().abs().maxCoeff());
  }
}

/// In vectors, when all points are finite and none has z = 0. \return false, with
/// nothing done, when they are not.
bool
surveyUsual(const pcl::PointXYZ* points, std::size_t n, PointSurvey& survey)
{
  using Vector = Eigen::Array4f; // x y z 1
  Vector nothing = Vector::Zero(), largest = Vector::Zero(), least = Vector::Ones();
  for (std::size_t i = 0; i < n; ++i) {
    const Vector q = points[i].getArray4fMap();
    nothing += q - q; // NaN stays NaN, and comes from what is infinite
    largest = largest.max(q.abs());
    least = least.min(q.abs());
  }
  if (!(nothing.head<3>() == 0.0F).all() || least[2] == 0.0F)
    return false;
  survey.finite += n;
  survey.largest = std::max(survey.largest, largest.head<3>().maxCoeff());
  return true;
}

/// Makes points that are not finite NaN. In one pass: a cloud of millions does not fit
/// into the cache.
PointSurvey
surveyPoints(pcl::PointCloud<pcl::PointXYZ>& points)
{
  constexpr std::size_t kBlock = 128;
  PointSurvey survey;
  for (std::size_t first = 0; first < points.size(); first += kBlock) {
    const std::size_t n = std::min(kBlock, points.size() - first);
    if (!surveyUsual(&points[first], n, survey))
      surveyAny(&points[first], n, survey);
  }
  return survey;
}

/// Coordinates are kept in single precision.
void
noteCoarseCoordinates(float largest, CloudFileInfo& info)
{
  constexpr float kNoCoordinate = 1e12F; // m: Neptune is 4e12 m away
  if (largest > kNoCoordinate) {
    info.notices.push_back(fmt::format(
        "coordinates up to {:.0e} m cannot be meant: bytes in another order, "
        "or a header that is not that of the data?",
        largest));
    return;
  }
  const double step_m = std::ldexp(largest, -23);
  if (step_m >= 1e-4)
    info.notices.push_back(
        fmt::format("coordinates up to {:.0f} m are only kept to {:.1g} m: if they are "
                    "in another unit, --unit says so, else move the cloud towards the "
                    "origin",
                    largest,
                    step_m));
}

void
noteOffset(io::RawCloud& raw)
{
  const Eigen::Vector3d& o = raw.offset;
  if (!o.isZero(0.0))
    raw.info.notices.push_back(
        fmt::format("coordinates shifted by {} {} {} m on the way to single precision",
                    -o.x(),
                    -o.y(),
                    -o.z()));
}

/// PCL writes 0 0 0 1 0 0 0 for clouds that know of no viewpoint.
void
dropDefaultViewpoint(CloudFileInfo& info)
{
  if (info.viewpoint && info.viewpoint->c.isZero(0.0) &&
      info.viewpoint->R.isIdentity(1e-9))
    info.viewpoint.reset();
}

/// The sensor's orientation when only its position is known: the file's, else that of
/// the axes, else towards the middle of the points.
Eigen::Matrix3d
orientationAt(const Eigen::Vector3d& position,
              const io::RawCloud& raw,
              const LoadOptions& options)
{
  const Eigen::Matrix3d turn = turnFromCamera(raw.info.axes);
  if (raw.info.viewpoint)
    return raw.info.viewpoint->R * turn;
  if (options.axes)
    return turn;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  int n = 0;
  for (const auto& point : *raw.points)
    if (pcl::isFinite(point)) {
      sum += point.getVector3fMap().cast<double>();
      ++n;
    }
  const Eigen::Vector3d forward = sum / n - position;
  if (forward.norm() < 1e-9)
    return turn;
  return Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), forward)
      .toRotationMatrix();
}

/// The sensor pose in the frame of the points, which lies at the offset.
Pose
sensorPoseOf(io::RawCloud& raw, const LoadOptions& options)
{
  const Eigen::Matrix3d turn = turnFromCamera(raw.info.axes);
  if (options.viewpoint) {
    const Eigen::Vector3d position = *options.viewpoint - raw.offset;
    return {orientationAt(position, raw, options), position};
  }
  const std::optional<Pose>& known =
      options.sensor_pose ? options.sensor_pose : raw.info.viewpoint;
  Pose pose; // of a file without viewpoint: the origin of the points
  if (known)
    pose = {known->R * turn, known->c - raw.offset};
  else
    pose.R = turn;
  if (options.sensor_pose || options.axes)
    return pose;
  std::string notice;
  pose = chooseSensorPose(raw.points, pose, &notice);
  if (!notice.empty())
    raw.info.notices.push_back(notice);
  return pose;
}

void
noteZeroPoints(CloudFileInfo& info)
{
  if (info.zero_points == 1)
    info.notices.emplace_back("1 point at the sensor is taken as invalid");
  else if (info.zero_points > 1)
    info.notices.push_back(
        fmt::format("{} points at the sensor are taken as invalid", info.zero_points));
}

/// The camera that the caller gave for a cloud.
void
applyCamera(const LoadOptions& options, io::RawCloud& raw)
{
  if (raw.info.is_depth_image || !options.camera_given)
    return;
  raw.info.camera = options.camera;
  if (raw.points->height > 1) {
    raw.info.camera->width = static_cast<int>(raw.points->width);
    raw.info.camera->height = static_cast<int>(raw.points->height);
  }
}

/// How many of the points at 0 0 0 stand for no return; they become NaN.
std::size_t
invalidatedZeros(std::size_t zeros,
                 const std::optional<Pose>& sensor_pose,
                 pcl::PointCloud<pcl::PointXYZ>& points)
{
  if (zeros == 0) // as nearly always: no pass over the points
    return 0;
  return static_cast<std::size_t>(
      invalidateZeroPoints(points, sensor_pose.value_or(Pose())));
}

void
requirePoints(std::size_t valid)
{
  if (valid == 0)
    throw std::runtime_error("has no valid point");
}

RangeCloud
finish(io::RawCloud& raw, LoadOptions options)
{
  auto& points = *raw.points;
  if (raw.info.is_depth_image)
    options.axes.reset(); // it has those of its camera
  CloudFileInfo& info = raw.info;
  info.axes = options.axes.value_or(CloudAxes::Camera);
  const PointSurvey survey = surveyPoints(points);
  dropDefaultViewpoint(info);
  applyCamera(options, raw);
  // Zeros are in nobody's view: out before the view is judged.
  std::size_t invalid_zeros = invalidatedZeros(survey.zeros, info.viewpoint, points);
  requirePoints(survey.finite - invalid_zeros);
  RangeCloud cloud;
  cloud.points = raw.points;
  cloud.offset = raw.offset;
  cloud.sensor_pose = sensorPoseOf(raw, options);
  // In other units, or seen from points far on the other side, 1e308 is infinite.
  if (const std::string error = validityError(cloud); !error.empty())
    throw std::runtime_error(error);
  // Nobody has to say the identity.
  cloud.sensor_pose_given = options.sensor_pose || options.viewpoint || options.axes ||
                            !isIdentity(cloud.sensor_pose);
  invalid_zeros +=
      invalidatedZeros(survey.zeros - invalid_zeros, cloud.sensor_pose, points);
  invalid_zeros +=
      static_cast<std::size_t>(invalidateMovedZeros(points, cloud.sensor_pose));
  requirePoints(survey.finite - invalid_zeros);
  cloud.covariances = std::make_shared<const Covariances>(std::move(raw.covariances));
  points.is_dense = survey.finite - invalid_zeros == points.size();
  info.zero_points += static_cast<int>(invalid_zeros);
  noteZeroPoints(info);
  noteOffset(raw);
  noteCoarseCoordinates(survey.largest, info);
  return cloud;
}

bool
isFinite(const std::optional<Pose>& pose)
{
  return !pose || (pose->c.allFinite() && pose->R.allFinite());
}

void
checkOptions(const LoadOptions& options)
{
  if (!(options.depth_scale > 0.0) || !std::isfinite(options.depth_scale))
    throw std::invalid_argument("the depth scale must be a positive number");
  if (!(options.unit_m > 0.0) || !std::isfinite(options.unit_m))
    throw std::invalid_argument("the unit must be a positive number");
  if (options.sensor_pose && options.viewpoint)
    throw std::invalid_argument("a sensor pose and a viewpoint are given");
  if (!isFinite(options.sensor_pose) ||
      !options.viewpoint.value_or(Eigen::Vector3d::Zero()).allFinite())
    throw std::invalid_argument("the sensor pose is not finite");
}

/// Coordinates of a cloud with an offset need double precision.
bool
isWide(const RangeCloud& cloud)
{
  return !cloud.offset.isZero(0.0);
}

std::string
pcdHeader(const RangeCloud& cloud, bool ascii)
{
  const bool has_covariances = cloud.hasCovariances();
  const Eigen::Vector3d c = cloud.sensor_pose.c + cloud.offset;
  const Eigen::Quaterniond q(cloud.sensor_pose.R);
  const int size = isWide(cloud) ? 8 : 4;
  std::string header =
      fmt::format("# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\n"
                  "FIELDS x y z{}\nSIZE {} {} {}{}\nTYPE F F F{}\nCOUNT 1 1 1{}\n",
                  has_covariances ? " covariance" : "",
                  size,
                  size,
                  size,
                  has_covariances ? " 4" : "",
                  has_covariances ? " F" : "",
                  has_covariances ? " 6" : "");
  header += fmt::format("WIDTH {}\nHEIGHT {}\nVIEWPOINT {} {} {} {} {} {} {}\n"
                        "POINTS {}\nDATA {}\n",
                        cloud.points->width,
                        cloud.points->height,
                        c.x(),
                        c.y(),
                        c.z(),
                        q.w(),
                        q.x(),
                        q.y(),
                        q.z(),
                        cloud.points->size(),
                        ascii ? "ascii" : "binary");
  return header;
}

/// A value of a row as text or in bytes.
template <typename T>
void
append(T value, bool ascii, std::string& row)
{
  if (ascii)
    fmt::format_to(std::back_inserter(row), "{}{}", row.empty() ? "" : " ", value);
  else
    row.append(reinterpret_cast<const char*>(&value), sizeof(T));
}

/// x y z, then xx xy xz yy yz zz when there are covariances.
std::string
pcdRow(const RangeCloud& cloud, std::size_t i, bool ascii)
{
  std::string row;
  const pcl::PointXYZ& p = (*cloud.points)[i];
  for (int k = 0; k < 3; ++k) {
    if (isWide(cloud))
      append(static_cast<double>(p.data[k]) + cloud.offset[k], ascii, row);
    else
      append(p.data[k], ascii, row);
  }
  if (cloud.hasCovariances()) {
    const Eigen::Matrix3f& s = (*cloud.covariances)[i];
    for (int r = 0; r < 3; ++r)
      for (int c = r; c < 3; ++c)
        append(s(r, c), ascii, row);
  }
  if (ascii)
    row += '\n';
  return row;
}

} // namespace

void
io::checkPointCount(std::uint64_t points, std::uint64_t max_points)
{
  if (points > max_points)
    throw std::runtime_error(
        fmt::format("announces {} points, more than --max-points {} allows",
                    points,
                    max_points));
}

Eigen::Matrix3d
turnFromCamera(CloudAxes axes)
{
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
  if (axes == CloudAxes::OpenGl)
    turn.diagonal() << 1.0, -1.0, -1.0;
  else if (axes == CloudAxes::Ros)
    turn << 0.0, 0.0, 1.0, -1.0, 0.0, 0.0, 0.0, -1.0, 0.0;
  return turn;
}

RangeCloud
loadCloud(const std::string& path, const LoadOptions& options, CloudFileInfo* info)
{
  checkOptions(options);
  try {
    io::RawCloud raw = readAny(path, options);
    RangeCloud cloud = finish(raw, options);
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
  for (std::size_t i = 0; i < cloud.points->size(); ++i)
    out << pcdRow(cloud, i, ascii);
  file.commit();
}

bool
isCloudFile(const std::string& path)
{
  // NAME.patches.ply, NAME.patches.pcd, NAME.dense.pcd: results
  const std::filesystem::path kind = std::filesystem::path(path).stem().extension();
  if (kind == ".patches" || kind == ".dense")
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
  if (!cloud.hasCovariances())
    return 0;
  int invalid = 0;
  for (std::size_t i = 0; i < cloud.points->size(); ++i)
    invalid += pcl::isFinite((*cloud.points)[i]) &&
               !isPositiveSemiDefinite((*cloud.covariances)[i].cast<double>());
  return invalid;
}

} // namespace holdfast
