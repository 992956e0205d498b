/// \file Between messages of ROS 1 and what the core knows.
#pragma once

#include "core/message_clouds.h"
#include "core/session.h"

#include <geometry_msgs/Transform.h>
#include <grid_map_msgs/GridMap.h>
#include <holdfast_msgs/FootholdArray.h>
#include <holdfast_msgs/PatchArray.h>
#include <nav_msgs/Odometry.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>
#include <sensor_msgs/PointCloud2.h>

#include <string>

namespace holdfast::robot {

Header toHeader(const std_msgs::Header& header);
std_msgs::Header toMessage(const Header& header);

geometry_msgs::Point toPoint(const Eigen::Vector3d& point);
geometry_msgs::Quaternion toQuaternion(const Eigen::Matrix3d& rotation);
geometry_msgs::Pose toMessage(const Pose& pose);
geometry_msgs::Transform toTransform(const Pose& pose);
Pose toPose(const geometry_msgs::Transform& transform);

/// \throw std::runtime_error when the message has no points that can be read.
RangeCloud toRangeCloud(const sensor_msgs::PointCloud2& message);

/// \param sensor with the camera of the image.
/// \throw std::runtime_error when the image is none of depth.
RangeCloud toRangeCloud(const sensor_msgs::Image& message, const Sensor& sensor);

/// Of the rectified image.
Camera toCamera(const sensor_msgs::CameraInfo& info);

VelocityError toVelocityError(const nav_msgs::Odometry& message);

/// Without what only the node knows: sensor, dropped frames, latency.
holdfast_msgs::PatchArray toPatchArray(const Answer& answer);

holdfast_msgs::FootholdArray toFootholds(const Answer& answer, const std::string& foot);

/// \param header its frame has the axes of the grid.
grid_map_msgs::GridMap toGridMap(const RiskGrid& grid, const std_msgs::Header& header);

} // namespace holdfast::robot
