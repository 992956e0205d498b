/// \file From the frames of a moving camera to a map of patches.
#pragma once

#include <holdfast/fusion/patch_map.h>
#include <holdfast/fusion/registration.h>
#include <holdfast/pcl/patch_extraction.h>

#include <optional>
#include <string>
#include <vector>

namespace holdfast {

/// How the sensor came from the frame before to this one.
struct Motion {
  Pose increment; ///< its new pose in its old frame
  /// Of (delta, c), as PatchMap::move().
  JetMatrix covariance = JetMatrix::Zero();
};

/// The sensor has not moved, but for the rounding of poses: FrameMapper::addStill().
bool isStill(const Pose& increment);

struct MappingOptions {
  PatchMapOptions map;
  /// Seeds, neighbourhoods, acceptance. The fits are of paraboloids, with the pattern
  /// apart where the sensor has one, whatever is said here, and the radius is the
  /// map's.
  ExtractionOptions extraction;
  RegistrationOptions registration;
  /// What is known of a motion that nobody tells, before the patches are asked: rad and
  /// m between frames, one standard deviation.
  double motion_sigma_rad = 0.05;
  double motion_sigma_m = 0.05;
};

/// What a frame did to the map.
struct FrameReport {
  UpdateReport update;
  int asked = 0; ///< seeds that the map wanted, and that could be seen
  int hidden = 0; ///< of patches before the camera: something is in front of them
  int measurements = 0;
  std::optional<RegistrationResult> registration; ///< where no motion was told
  ExtractionResult extraction; ///< whose patches are those of this frame alone
};

/// Keeps a map: fits patches where it wants them and where it has none, finds the pose
/// where it is not told, and updates. The same for any number of threads.
class FrameMapper {
public:
  /// \throw std::invalid_argument when an option makes no sense.
  FrameMapper(const Sensor& sensor, const MappingOptions& options = {});

  /// Goes on with a map.
  FrameMapper(const Sensor& sensor, const MappingOptions& options, PatchMap map);

  /// Takes the next frame from a sensor that has moved as told.
  /// \param frame organized, its sensor pose where the sensor is in its own points.
  /// \throw std::invalid_argument when the frame is not organized, or the covariance
  /// of the motion is none (PatchMap::move()).
  /// \param former a report that is done with: the memory of its patches is used again,
  ///        so that from the second frame of a size on patches take none but for what
  ///        the map bears and, where the sensor has a pattern, their part of it.
  FrameReport add(const RangeCloud& frame,
                  const Motion& motion,
                  FrameReport former = {});

  /// The same from a sensor that has not moved.
  FrameReport addStill(const RangeCloud& frame, FrameReport former = {});

  /// The same from a sensor of which nobody knows how it has moved: registerPatches()
  /// finds it, from where the last motion goes on. What that leaves open is as
  /// uncertain as MappingOptions says. Where it fails (FrameReport::registration) the
  /// map stays as it is, and the next frame is looked for where that motion, gone on
  /// for longer, leads. Where the motion was another one, so that supports were not
  /// those of the map's patches, the frame is measured again from the pose found, if
  /// the sampler's limit of time leaves enough.
  FrameReport addUnknown(const RangeCloud& frame, FrameReport former = {});

  const PatchMap& map() const
  {
    return map_;
  }

private:
  struct Places;

  void matchSensor(const RangeCloud& frame);
  Places placesIn(const RangeCloud& frame, const Pose& sensor, FrameReport& report);
  void measure(const RangeCloud& frame,
               const Pose& sensor,
               double max_time_s,
               FrameReport& report);
  FrameReport addFrom(const RangeCloud& frame, FrameReport former);
  RegistrationResult registered(const Pose& guess) const;
  bool isFarOff(const Pose& guess, const Pose& found) const;
  void moveTo(const RegistrationResult& result);

  /// What a frame says.
  struct Measured {
    std::vector<Measurement> measurements;
    std::vector<std::uint64_t> seen_through;
  };

  Sensor sensor_;
  std::optional<Sensor> matched_; ///< with the camera on whose pixels the frames lie
  MappingOptions options_;
  PatchMap map_;
  Measured measured_;
  Pose step_; ///< from frame to frame, of the last motion that was found
  int frames_missed_ = 0; ///< since
};

/// The map of a single cloud, organized or not, in its frame.
/// \param extraction if not null: receives the patches of the cloud as they are alone.
/// \throw std::invalid_argument as FrameMapper and extractPatches().
PatchMap mapOfCloud(const RangeCloud& cloud,
                    const Sensor& sensor,
                    const MappingOptions& options,
                    ExtractionResult* extraction = nullptr);

/// The options of a map for a sensor: how far the errors of its pixels reach.
PatchMapOptions mapOptionsFor(const Sensor& sensor, PatchMapOptions options = {});

/// The options of a mapper for a sensor: a map of the radius of these neighbourhoods.
MappingOptions mappingOptionsFor(const Sensor& sensor,
                                 const ExtractionOptions& extraction);

} // namespace holdfast
