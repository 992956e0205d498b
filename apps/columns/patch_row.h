/// \file A patch, and a cloud, as rows of a table.
#pragma once

#include <holdfast/patch/state.h>

#include <array>
#include <cstdint>
#include <limits>
#include <string>

namespace holdfast {
struct ExtractedPatch;
struct PatchReport;
} // namespace holdfast

namespace holdfast::app {

inline constexpr double kNoNumber = std::numeric_limits<double>::quiet_NaN();
inline constexpr float kNoFloat = std::numeric_limits<float>::quiet_NaN();

/// Entries of the lower triangle of the largest covariance.
inline constexpr std::size_t kTriangle = kMaxState * (kMaxState + 1) / 2;

/// An array without a number in it.
template <std::size_t n>
constexpr std::array<double, n>
noNumbers()
{
  std::array<double, n> values{};
  for (double& value : values)
    value = kNoNumber;
  return values;
}

/// What has no value is NaN, and -1 among whole numbers. Positions are in the frame of
/// the file, m. A plain copy of its bytes is the same row.
struct PatchRow {
  std::array<double, kMaxState> state = noNumbers<kMaxState>(); ///< as stateNames()
  /// Its covariance: xx yx yy zx zy zz ..., row by row of the lower triangle.
  std::array<double, kTriangle> state_covariance = noNumbers<kTriangle>();
  std::array<double, kMaxParameters> parameters = noNumbers<kMaxParameters>();
  std::array<double, 3> centre = noNumbers<3>();
  std::array<double, 3> normal = noNumbers<3>(); ///< z of the state's frame
  std::array<double, 3> x_axis = noNumbers<3>(); ///< x of it; y is z cross x
  std::array<double, 3> seed = noNumbers<3>();
  double chi2 = kNoNumber;
  double chi2_expected = kNoNumber;
  float nonlinearity = kNoFloat;
  float radius = kNoFloat;
  float residual_rms = kNoFloat;
  float residual_largest = kNoFloat;
  float residual_unexplained = kNoFloat;
  float coverage = kNoFloat;
  float extent = kNoFloat;
  float sagitta = kNoFloat;
  float curvature = kNoFloat;
  float noise = kNoFloat;
  float view_angle = kNoFloat;
  float stray = kNoFloat;
  std::int32_t seed_index = -1;
  std::int32_t points = 0;
  std::int32_t uninformative_points = 0;
  std::int32_t chi2_dof = 0;
  std::int32_t iterations = 0;
  std::uint32_t cloud = 0; ///< row of the clouds
  std::uint8_t surface = 0; ///< SurfaceType
  std::uint8_t boundary = 0; ///< BoundaryType
  std::uint8_t status = 0; ///< FitStatus
  std::uint8_t verdict = kNotMeasured; ///< PatchVerdict
  std::uint8_t flags = 0; ///< a bit for each of kFitFlagNames
  std::uint8_t second_attempt = 0;

  static constexpr std::uint8_t kNotMeasured = 255;
};

/// What the patches of a cloud have in common.
struct CloudRow {
  std::string name; ///< of its results
  std::string path; ///< as `holdfast fit` was told
  std::string fingerprint; ///< may be empty
  std::string settings; ///< sensor and options as a JSON object
  std::array<double, 3> position = noNumbers<3>(); ///< of the sensor, file's frame, m
  std::array<double, 4> orientation_wxyz = noNumbers<4>();
  std::array<double, 3> offset{}; ///< from the frame of the points to the file's, m
  std::uint64_t first_patch = 0; ///< row
  std::uint64_t patches = 0;
};

/// The row of a patch whose positions `offset` takes to the frame of the file.
PatchRow rowOf(const ExtractedPatch& patch, const Eigen::Vector3d& offset);

/// The row of a cloud, without its patches, from what stands around them in its JSON.
/// \param name of its results. \throw std::runtime_error when that is no result.
CloudRow cloudRowOf(const std::string& name, const std::string& json);

/// The row of a cloud, with the number of its patches.
CloudRow cloudRowOf(const std::string& name, const PatchReport& report);

} // namespace holdfast::app
