/// \file From frames to what the node publishes, without a word of any ROS.
#pragma once

#include "core/odometry.h"
#include "core/settings.h"
#include "core/trouble.h"

#include <holdfast/contact/foothold.h>
#include <holdfast/contact/risk_grid.h>
#include <holdfast/pcl/frame_extraction.h>
#include <holdfast/pcl/frame_mapping.h>

#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

namespace holdfast::robot {

using Stamp = std::int64_t; ///< ns

struct Header {
  Stamp stamp = 0;
  std::string frame_id;
};

/// A message that has come.
struct Frame {
  Header header;
  RangeCloud cloud; ///< in the frame of its header; its sensor pose is not used
  std::optional<Camera> camera; ///< on whose pixels the points are known to lie
  std::string unreadable; ///< why there is no cloud; empty: there is one
};

/// The pose of frame `source` in frame `target` at a time; where there is none, nothing
/// and the `cause`.
using TransformLookup = std::function<std::optional<Pose>(const std::string& target,
                                                          const std::string& source,
                                                          Stamp stamp,
                                                          std::string& cause)>;

struct AnswerPatch {
  ExtractedPatch patch;
  std::uint64_t id = 0; ///< in the map; 0: there is none
  int views = 0; ///< independent ones
  bool is_seen_now = true; ///< in this frame
};

struct RiskAnswer {
  RiskGrid grid;
  FootholdRanking ranking;
  Eigen::Vector3d load_direction = -Eigen::Vector3d::UnitZ(); ///< frame of the answer
};

struct Complaint {
  Trouble trouble = Trouble::Unusable;
  std::string text; ///< one line
};

/// What is known after a frame. There is one for every frame.
struct Answer {
  Header cloud; ///< of the frame
  Header header; ///< the same stamp, and the frame that everything is in
  bool is_map = false; ///< the patches are those of the map
  std::vector<AnswerPatch> patches;
  int failed_seeds = 0; ///< that gave no patch
  int turned_down = 0; ///< patches that did not keep the limits
  std::optional<RiskAnswer> risk; ///< where a foot was named
  /// Of the map in the frame of the cloud, where nobody else knows.
  std::optional<Pose> map_in_cloud;
  std::vector<Complaint> complaints;
  std::vector<std::string> notices; ///< what there is to know besides
  double work_ms = 0.0;
  bool time_jumped = false; ///< backwards
};

/// Answers one frame after another: with the patches of that frame or, if a map is
/// kept, with those of the map. tune() and hear() may be called from other threads.
class Session {
public:
  /// \throw std::runtime_error when sensor or foot cannot be read, and
  /// std::invalid_argument when a setting makes no sense.
  Session(const Settings& settings, const Tuning& tuning, TransformLookup lookup);

  /// From the next frame on; a map of another radius starts anew.
  /// \throw std::invalid_argument with validityError().
  void tune(const Tuning& tuning);

  /// What the motion from now on may be off by.
  void hear(const VelocityError& error);

  /// Never throws for what is wrong with a frame: that is in the answer.
  Answer answer(const Frame& frame);

  /// Of the sensor, as it is without a frame.
  const Sensor& sensor() const
  {
    return sensor_;
  }

  /// Name of the foot; empty: there is none.
  const std::string& footName() const
  {
    return settings_.foot.empty() ? settings_.foot : foot_.name;
  }

private:
  void startAnew();
  void takeTuning(Answer& answer);
  void watchTime(const Frame& frame, Answer& answer);
  void watchCamera(const RangeCloud& cloud, const std::optional<Camera>& camera);
  Pose find(const std::string& target, const std::string& source, Stamp stamp) const;
  RangeCloud placed(const Frame& frame);
  void answerFrame(const RangeCloud& cloud, Answer& answer);
  void answerRisk(const RangeCloud& cloud, Answer& answer);
  void answerMap(const RangeCloud& cloud, Answer& answer);
  FrameReport addToMap(const RangeCloud& cloud, const Header& header);
  FrameReport addMoved(const RangeCloud& cloud, const Header& header, const Pose& pose);
  JetMatrix motionError(const Pose& motion, const Header& header) const;
  void takeResult(ExtractionResult result, Answer& answer) const;
  void takeMap(const PatchMap& map, Answer& answer) const;
  void rank(const PatchMap& map, const Eigen::Vector3d& load, Answer& answer) const;
  Eigen::Vector3d loadIn(const RangeCloud& cloud, const Header& header) const;
  bool hasFoot() const
  {
    return !settings_.foot.empty();
  }

  const Settings settings_;
  const TransformLookup lookup_;
  Sensor sensor_;
  Foot foot_;

  std::mutex mutex_; ///< of the next two
  Tuning tuning_;
  std::optional<VelocityError> velocity_;

  // Of the thread that answers.
  Tuning taken_; ///< the tuning that the rest was made for
  std::optional<VelocityError> velocity_taken_;
  ExtractionOptions options_;
  std::optional<Sensor> matched_; ///< with the camera of the frames
  std::optional<FrameExtractor> extractor_;
  std::optional<FrameMapper> mapper_;
  std::optional<Stamp> last_stamp_;
  std::optional<Pose> last_pose_; ///< of the sensor in the odometry frame
  Stamp last_pose_stamp_ = 0;
};

} // namespace holdfast::robot
