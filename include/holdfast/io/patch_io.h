/// \file Fitted patches to and from files.
#pragma once

#include <holdfast/fusion/patch_map.h>
#include <holdfast/io/cloud_io.h>
#include <holdfast/pcl/dense_extraction.h>
#include <holdfast/pcl/patch_extraction.h>

#include <array>
#include <cstdint>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

namespace holdfast {

/// Everything a result file says about one cloud.
struct PatchReport {
  std::string cloud; ///< file, or frame, the patches come from
  /// A word for what the patches were made with, such as a hash of version, options and
  /// sensor; empty: none.
  std::string fingerprint;
  std::optional<std::uint64_t> timestamp_us; ///< of a frame, by the camera's clock
  std::optional<CloudFileInfo> file; ///< what was said and done when it was read
  Pose sensor_pose;
  Eigen::Vector3d offset = Eigen::Vector3d::Zero(); ///< RangeCloud::offset
  ExtractionOptions options;
  bool covariances_of_cloud = false; ///< not the sensor's noise
  bool whole = false; ///< one patch to all points: the sampler options do not apply
  ExtractionResult result;
  /// The map whose patches those of the result are, one by one; null: they are of one
  /// cloud. Each then says under "map" what the map knows of it.
  const PatchMap* map = nullptr;
  bool is_of_map = false; ///< as read from a file: no cloud belongs to the patches
  double load_ms = 0.0;
  double fit_ms = 0.0;
};

enum class JsonLayout : std::uint8_t {
  OneLine, ///< so that the objects of several clouds make JSON Lines
  PatchPerLine
};

/// Writes the report as one JSON object and a newline, in the frame of the file: the
/// offset is added to every position. Numbers survive the way to text and back bit for
/// bit; those that are not finite become null. Beside a patch's verdict stand what the
/// limits judge: `residual` (rms, largest, and the largest
/// that noise does not explain, m), `coverage` (share), and `measured`:
/// extent, sagitta and noise (m), curvature (1/m), view_angle (rad), stray (share),
/// null where it was not asked for; chi-square over chi2_expected is the fit's.
void writeJson(std::ostream& out, const PatchReport& report, JsonLayout layout);

/// Reads the cloud's name, the fingerprint, how its file was read, the sensor's pose,
/// the offset, the patches and the rejected counts of a JSON object written by
/// writeJson(); the other members of the report keep their defaults. Positions are
/// again those of the points, with the offset taken off. \throw std::runtime_error when
/// the text is no such object.
PatchReport readJson(const std::string& text);

/// Writes the patches as one triangle mesh (PLY: vertices x y z in metres, red green
/// blue, in the frame of the cloud), each with edges of about an eighth of its length.
/// Colours go by surface type, darker where points support less of a measured patch:
/// full at a coverage of 1, half at 0. \param offset is added to the vertices, which
/// are then written in double precision.
void writeMesh(std::ostream& out,
               const std::vector<ExtractedPatch>& patches,
               bool ascii,
               const Eigen::Vector3d& offset = Eigen::Vector3d::Zero());

/// Writes the patches, one at least, as a compressed PCD of PatchPoint, which PCL and
/// its tools read. The points stay in the frame of the cloud's points, which single
/// precision can hold; a comment at the top names the offset that takes them to that of
/// the file, if there is one.
/// \throw std::length_error when they are more than such a file can hold, some 5
/// million.
void writePatchPoints(std::ostream& out,
                      const std::vector<ExtractedPatch>& patches,
                      const Pose& sensor_pose,
                      const Eigen::Vector3d& offset = Eigen::Vector3d::Zero());

/// The same of an image of attempts, as an organized cloud.
void writePatchPoints(std::ostream& out,
                      const DenseExtraction& dense,
                      const Pose& sensor_pose,
                      const Eigen::Vector3d& offset = Eigen::Vector3d::Zero());

/// Colour of a surface type in meshes, red green blue.
std::array<std::uint8_t, 3> surfaceColor(SurfaceType surface);

} // namespace holdfast
