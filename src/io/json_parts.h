/// \file Vectors, poses, cameras, patterns and points, which all results tell alike.
#pragma once

#include <holdfast/geometry/pose.h>
#include <holdfast/noise_pattern.h>
#include <holdfast/pcl/point_accounting.h>
#include <holdfast/sensor/camera.h>

#include <nlohmann/json.hpp>

#include <Eigen/Core>

#include <stdexcept>
#include <string>

namespace holdfast::io {

template <typename Derived>
nlohmann::ordered_json
vectorJson(const Eigen::MatrixBase<Derived>& v)
{
  auto array = nlohmann::ordered_json::array();
  for (Eigen::Index i = 0; i < v.size(); ++i)
    array.push_back(v(i) + 0.0); // -0 becomes 0
  return array;
}

/// \throw nlohmann::json::exception, or std::runtime_error when it is not n finite
/// numbers.
template <int n, typename Json>
Eigen::Matrix<double, n, 1>
vectorFromJson(const Json& json)
{
  if (!json.is_array() || json.size() != n)
    throw std::runtime_error("has a vector of another length than " +
                             std::to_string(n));
  Eigen::Matrix<double, n, 1> v;
  for (int i = 0; i < n; ++i)
    v[i] = json.at(static_cast<std::size_t>(i)).template get<double>();
  if (!v.allFinite())
    throw std::runtime_error("has a vector that is not finite");
  return v;
}

/// "position" and "orientation_wxyz".
/// \param offset of the frame of the pose in that of the file, m.
nlohmann::ordered_json poseJson(
    const Pose& pose,
    const Eigen::Vector3d& offset = Eigen::Vector3d::Zero());

/// \throw as vectorFromJson(), or when the orientation is none.
Pose poseFromJson(const nlohmann::json& json, const Eigen::Vector3d& offset);

nlohmann::ordered_json cameraJson(const Camera& camera);

/// \throw nlohmann::json::exception, or std::runtime_error when a focal length is not
/// positive.
Camera cameraFromJson(const nlohmann::json& json);

/// Sigmas in the unit of the noise model: px of disparity for stereo, m at 1 m for
/// others.
nlohmann::ordered_json patternJson(const NoisePattern& pattern);

/// "cloud_points".
nlohmann::ordered_json pointsJson(const PointAccounting& points);

/// \throw nlohmann::json::exception, or std::runtime_error when the member is not
/// positive and finite.
double positiveFromJson(const nlohmann::json& json, const char* name);

} // namespace holdfast::io
