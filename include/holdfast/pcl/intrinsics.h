/// \file What an organized cloud tells about the camera that took it.
#pragma once

#include <holdfast/pcl/range_cloud.h>
#include <holdfast/sensor/sensor.h>

#include <optional>
#include <string>

namespace holdfast {

/// Rms distance, in px, between the pixel (column, row) of each point of an organized
/// cloud and the pixel in which `camera` sees it; nothing when the cloud is not
/// organized or no point lies in front of the camera.
std::optional<double> pixelResidual(const RangeCloud& cloud, const Camera& camera);

/// The pinhole camera whose pixels the points of an organized cloud lie on: least
/// squares of the column against x/z and of the row against y/z (camera frame). Nothing
/// when the cloud is not organized, its points do not spread over rows and columns, or
/// the fit is worse than 1 px rms.
/// \param rms_px if not null: the residual of the fit, px, when there is one.
std::optional<Camera> recoverIntrinsics(const RangeCloud& cloud,
                                        double* rms_px = nullptr);

/// True when a cloud with the camera `recovered` may have been taken by a sensor with
/// the nominal `camera`: images of the same size, focal lengths and principal points
/// within 5 % of focal length and image, by which cameras of one type differ from each
/// other.
bool isOfType(const Camera& recovered, const Camera& camera);

/// The frame of the points in a file, as a sensor pose. PCL's files disagree about
/// VIEWPOINT: some hold points in the camera frame although VIEWPOINT carries a
/// rotation (0 0 0 0 1 0 0) that is meant for display.
///
/// \return `file_pose` whenever it has a position: that was meant. An orientation alone
/// is set aside for the identity, with a one-line `notice`, where the points contradict
/// it and not the identity: nearly all of them lie in front of a camera in the one pose
/// and, when organized, on its pixels, and not in the other.
Pose chooseSensorPose(const pcl::PointCloud<pcl::PointXYZ>::ConstPtr& points,
                      const Pose& file_pose,
                      std::string* notice = nullptr);

/// False when most points lie where the sensor cannot have measured them: the cloud has
/// other axes or units, or its sensor pose is none. extractPatches() does not use the
/// noise of the sensor then. True for sensors that see all around.
bool mayBeSeenBy(const RangeCloud& cloud, const Sensor& sensor);

/// The sensor with the camera of this cloud: when an organized cloud's points are more
/// than 2 px rms (about 1 % of focal length) off the sensor's pixels, the recovered
/// camera replaces the sensor's, with a one-line `notice`.
///
/// Only the pixel geometry changes. The noise model keeps its own baseline and focal
/// length: they belong to the camera that measured the disparity, whose image may have
/// been registered to another one before the cloud was made.
Sensor matchedSensor(const Sensor& sensor,
                     const RangeCloud& cloud,
                     std::string* notice = nullptr);

} // namespace holdfast
