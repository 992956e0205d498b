/// \file Between PCL's clouds of patches and a patch map.
#pragma once

#include <holdfast/fusion/patch_map.h>
#include <holdfast/pcl/point_types.h>

#include <pcl/point_cloud.h>

#include <vector>

namespace holdfast {

/// What the patches of one view say, in the frame of the sensor, where that stood when
/// the cloud says so; ids in the order of the points. Patches should have been fitted
/// as SurfaceRequest::Paraboloid: others, those that are NaN, and those of an unknown
/// type are left out.
///
/// A PatchPoint has neither its points nor the part of the pattern apart. Its support
/// counts as an even ellipse, and its error as independent of other views': do not fuse
/// frames of a camera that stands still this way (FrameMapper does that right).
/// \param left_out if not null: how many points gave no measurement.
std::vector<Measurement> toMeasurements(const pcl::PointCloud<PatchPoint>& patches,
                                        int* left_out = nullptr);

/// Fuses the patches of a sensor that has moved by an increment, and tells the map so.
/// \param covariance as PatchMap::move(), which is not called for the first cloud.
UpdateReport updateMap(PatchMap& map,
                       const pcl::PointCloud<PatchPoint>& patches,
                       const Pose& increment,
                       const JetMatrix& covariance,
                       int* left_out = nullptr);

/// The patches of a map in its frame, seen from where the sensor is: toFitResult() of
/// each. `seed` is the number of independent views.
pcl::PointCloud<PatchPoint> toPatchCloud(const PatchMap& map,
                                         const FitOptions& options = {});

} // namespace holdfast
