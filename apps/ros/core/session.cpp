#include "core/session.h"

#include <holdfast/geometry/constants.h>
#include <holdfast/io/config.h>
#include <holdfast/io/foot_file.h>
#include <holdfast/pcl/intrinsics.h>
#include <holdfast/pcl/pattern_subtraction.h>

#include <fmt/core.h>

#include <algorithm>
#include <chrono>
#include <exception>
#include <stdexcept>
#include <utility>

namespace holdfast::robot {
namespace {

constexpr double kDefaultRadius = 0.05; // m
/// Frames that come this much too late are late; more, and time itself went back.
constexpr Stamp kLateness = 1000000000; // ns

ExtractionOptions
extractionOptions(const Settings& settings, const Tuning& tuning, const Foot& foot)
{
  ExtractionOptions options;
  options.fit.surface = settings.surface;
  options.threads = settings.threads;
  options.sampler.radius_m = tuning.radius_m > 0.0 ? tuning.radius_m :
                             settings.foot.empty() ? kDefaultRadius :
                                                     patchRadiusFor(foot);
  options.sampler.max_patches = tuning.max_patches;
  options.sampler.max_time_s = 1e-3 * tuning.budget_ms;
  options.validation->max_chi2_per_dof = tuning.max_chi2_per_dof;
  options.validation->min_coverage = tuning.min_coverage;
  options.validation->max_view_angle_rad = tuning.max_view_angle_deg * kPi / 180.0;
  if (tuning.max_curvature_per_m > 0.0)
    options.validation->max_curvature_per_m = tuning.max_curvature_per_m;
  return options;
}

template <typename Counts>
int
sumOf(const Counts& counts)
{
  int sum = 0;
  for (const auto& [reason, count] : counts)
    sum += count;
  return sum;
}

bool
isSame(const Camera& a, const Camera& b)
{
  return a.width == b.width && a.height == b.height && a.fx == b.fx && a.fy == b.fy &&
         a.cx == b.cx && a.cy == b.cy;
}

} // namespace

Session::Session(const Settings& settings, const Tuning& tuning, TransformLookup lookup)
: settings_(settings), lookup_(std::move(lookup)), sensor_(loadSensor(settings.sensor))
{
  if (!settings.pattern)
    sensor_ = withoutPattern(sensor_);
  if (hasFoot())
    foot_ = loadFoot(settings.foot);
  if (const std::string error = validityError(settings); !error.empty())
    throw std::invalid_argument(error);
  tune(tuning);
  taken_ = tuning;
  startAnew();
}

void
Session::tune(const Tuning& tuning)
{
  if (const std::string error = validityError(tuning); !error.empty())
    throw std::invalid_argument(error);
  const std::lock_guard<std::mutex> lock(mutex_);
  tuning_ = tuning;
}

void
Session::hear(const VelocityError& error)
{
  const std::lock_guard<std::mutex> lock(mutex_);
  velocity_ = error;
}

void
Session::startAnew()
{
  options_ = extractionOptions(settings_, taken_, foot_);
  matched_.reset();
  extractor_.reset();
  mapper_.reset();
  last_pose_.reset();
}

void
Session::takeTuning(Answer& answer)
{
  Tuning wanted;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    wanted = tuning_;
    velocity_taken_ = velocity_;
  }
  if (wanted == taken_)
    return;
  taken_ = wanted;
  if (mapper_)
    answer.notices.push_back("other limits: the map starts anew");
  startAnew();
}

void
Session::watchTime(const Frame& frame, Answer& answer)
{
  const Stamp stamp = frame.header.stamp;
  if (last_stamp_ && stamp < *last_stamp_) {
    const double back_s = 1e-9 * static_cast<double>(*last_stamp_ - stamp);
    if (*last_stamp_ - stamp < kLateness)
      throw FrameError(Trouble::TimeJump,
                       fmt::format("a frame is {:.3f} s older than the one before it "
                                   "and is left out",
                                   back_s));
    answer.time_jumped = true;
    answer.complaints.push_back({Trouble::TimeJump,
                                 fmt::format("time went back by {:.3f} s{}",
                                             back_s,
                                             mapper_ ? ": the map starts anew" : "")});
    startAnew();
  }
  last_stamp_ = stamp;
}

/// The camera of a frame is that which came with it; else the points of the first frame
/// of a size tell it.
void
Session::watchCamera(const RangeCloud& cloud, const std::optional<Camera>& camera)
{
  if (camera) {
    if (!matched_ || !isSame(matched_->camera, *camera))
      startAnew();
    if (!matched_)
      matched_ = withCamera(sensor_, *camera);
    return;
  }
  const bool has_pixels = cloud.points->height > 1;
  if (matched_ && (!has_pixels || cloud.hasSizeOf(matched_->camera)))
    return;
  startAnew();
  matched_ = matchedSensor(sensor_, cloud);
}

Pose
Session::find(const std::string& target, const std::string& source, Stamp stamp) const
{
  if (target.empty() || source.empty())
    throw FrameError(Trouble::WrongFrame, "the cloud does not name its frame");
  if (target == source)
    return {};
  std::string cause;
  const std::optional<Pose> pose = lookup_(target, source, stamp, cause);
  if (!pose)
    throw FrameError(
        Trouble::MissingTransform,
        fmt::format("no transform from {} to {}: {}", source, target, cause));
  return *pose;
}

/// The cloud with the pose of its sensor, less the sensor's map of errors.
RangeCloud
Session::placed(const Frame& frame)
{
  if (!frame.unreadable.empty())
    throw FrameError(Trouble::Unreadable, frame.unreadable);
  if (countValidPoints(frame.cloud) == 0)
    throw FrameError(Trouble::NoValidPoint, "a cloud has no valid point");
  const std::string& frame_id = frame.header.frame_id;
  RangeCloud cloud = frame.cloud;
  const Pose turn{turnFromCamera(settings_.axes), Eigen::Vector3d::Zero()};
  cloud.sensor_pose =
      settings_.sensor_frame.empty() ?
          turn :
          find(frame_id, settings_.sensor_frame, frame.header.stamp) * turn;
  cloud.sensor_pose_given = true;
  watchCamera(cloud, frame.camera);
  if (!mayBeSeenBy(cloud, *matched_))
    throw FrameError(
        Trouble::WrongFrame,
        fmt::format("most points of a cloud in frame '{}' lie where the sensor {} "
                    "cannot see: its frame, axes or unit are others than said",
                    frame_id,
                    sensor_.name));
  return subtractPatternMap(cloud, *matched_);
}

Answer
Session::answer(const Frame& frame)
{
  const auto start = std::chrono::steady_clock::now();
  Answer answer;
  answer.cloud = answer.header = frame.header;
  try {
    takeTuning(answer);
    watchTime(frame, answer);
    const RangeCloud cloud = placed(frame);
    if (settings_.map)
      answerMap(cloud, answer);
    else if (hasFoot())
      answerRisk(cloud, answer);
    else
      answerFrame(cloud, answer);
  }
  catch (const FrameError& error) {
    answer.complaints.push_back({error.trouble, error.what()});
  }
  catch (const std::exception& error) {
    answer.complaints.push_back({Trouble::Unusable, error.what()});
  }
  answer.work_ms = std::chrono::duration<double, std::milli>(
                       std::chrono::steady_clock::now() - start)
                       .count();
  return answer;
}

void
Session::takeResult(ExtractionResult result, Answer& answer) const
{
  for (ExtractedPatch& patch : result.patches)
    answer.patches.push_back({std::move(patch)});
  answer.failed_seeds = sumOf(result.rejected);
  answer.turned_down = sumOf(result.turned_down);
  answer.notices.insert(answer.notices.end(),
                        result.notices.begin(),
                        result.notices.end());
}

/// An organized cloud with a number of patches is one of a stream, whose seeds stay;
/// any other is done as a file is.
void
Session::answerFrame(const RangeCloud& cloud, Answer& answer)
{
  if (options_.sampler.max_patches == 0 || cloud.points->height < 2)
    return takeResult(extractPatches(cloud, *matched_, options_), answer);
  if (!extractor_)
    extractor_.emplace(*matched_, options_);
  takeResult(extractor_->extract(cloud), answer);
}

/// The risk of a single frame, in its own frame.
void
Session::answerRisk(const RangeCloud& cloud, Answer& answer)
{
  ExtractionResult result;
  const PatchMap map =
      mapOfCloud(cloud, *matched_, mappingOptionsFor(*matched_, options_), &result);
  takeResult(std::move(result), answer);
  rank(map, loadIn(cloud, answer.header), answer);
}

Eigen::Vector3d
Session::loadIn(const RangeCloud& cloud, const Header& header) const
{
  if (settings_.odometry_frame.empty())
    return settings_.load_direction.value_or(cloud.sensor_pose.R.col(1));
  const Pose odometry = find(header.frame_id, settings_.odometry_frame, header.stamp);
  return odometry.R *
         settings_.load_direction.value_or(-Eigen::Vector3d::UnitZ().eval());
}

void
Session::rank(const PatchMap& map, const Eigen::Vector3d& load, Answer& answer) const
{
  if (map.patches().empty())
    return;
  FootholdOptions footholds = footholdOptions(settings_);
  footholds.load_direction = load;
  RiskGridOptions grid = gridOptions(settings_);
  grid.load_direction = load;
  answer.risk = {riskGrid(map, foot_, grid),
                 rankFootholds(map, foot_, footholds),
                 load};
}

void
Session::answerMap(const RangeCloud& cloud, Answer& answer)
{
  if (cloud.points->height < 2)
    throw FrameError(Trouble::Unusable,
                     "a map wants frames of a camera, and these points lie on no rows "
                     "and columns");
  const FrameReport report = addToMap(cloud, answer.header);
  if (report.registration &&
      report.registration->status != RegistrationStatus::Converged)
    answer.complaints.push_back(
        {Trouble::Lost, "the pose of a frame in the map was not found"});
  answer.failed_seeds = sumOf(report.extraction.rejected);
  answer.turned_down = sumOf(report.extraction.turned_down);
  answer.notices.insert(answer.notices.end(),
                        report.extraction.notices.begin(),
                        report.extraction.notices.end());
  const PatchMap& map = mapper_->map();
  const bool has_odometry = !settings_.odometry_frame.empty();
  if (!has_odometry)
    answer.map_in_cloud = cloud.sensor_pose * map.pose().inverse();
  answer.header.frame_id =
      has_odometry ? settings_.odometry_frame : settings_.map_frame;
  takeMap(map, answer);
  // Without odometry the map's frame is that of the camera at first, y down the image.
  if (hasFoot())
    rank(map,
         settings_.load_direction.value_or(has_odometry ?
                                               -Eigen::Vector3d::UnitZ().eval() :
                                               Eigen::Vector3d::UnitY().eval()),
         answer);
}

FrameReport
Session::addToMap(const RangeCloud& cloud, const Header& header)
{
  const MappingOptions options = mappingOptionsFor(*matched_, options_);
  if (settings_.odometry_frame.empty()) {
    if (!mapper_)
      mapper_.emplace(*matched_, options);
    return mapper_->addUnknown(cloud);
  }
  const Pose pose =
      find(settings_.odometry_frame, header.frame_id, header.stamp) * cloud.sensor_pose;
  if (!mapper_) {
    PatchMap::Snapshot empty;
    empty.options = options.map;
    empty.pose = pose;
    mapper_.emplace(*matched_, options, PatchMap(empty));
  }
  FrameReport report = addMoved(cloud, header, pose);
  last_pose_ = pose;
  last_pose_stamp_ = header.stamp;
  return report;
}

FrameReport
Session::addMoved(const RangeCloud& cloud, const Header& header, const Pose& pose)
{
  const Pose motion = last_pose_ ? last_pose_->inverse() * pose : Pose();
  if (isStill(motion))
    return mapper_->addStill(cloud);
  return mapper_->add(cloud, {motion, motionError(motion, header)});
}

JetMatrix
Session::motionError(const Pose& motion, const Header& header) const
{
  JetVector sigmas;
  sigmas << Eigen::Vector3d::Constant(settings_.motion_sigma_rad),
      Eigen::Vector3d::Constant(settings_.motion_sigma_m);
  JetMatrix covariance = sigmas.cwiseAbs2().asDiagonal();
  if (!velocity_taken_)
    return covariance;
  const std::string& camera =
      settings_.sensor_frame.empty() ? header.frame_id : settings_.sensor_frame;
  const Pose sensor = find(velocity_taken_->frame_id, camera, header.stamp) *
                      Pose{turnFromCamera(settings_.axes), Eigen::Vector3d::Zero()};
  return covariance +
         motionCovariance(velocity_taken_->covariance,
                          1e-9 * static_cast<double>(header.stamp - last_pose_stamp_),
                          motion,
                          sensor);
}

void
Session::takeMap(const PatchMap& map, Answer& answer) const
{
  answer.is_map = true;
  for (const MapPatch& patch : map.patches()) {
    AnswerPatch answered;
    answered.patch.fit = toFitResult(patch, options_.fit);
    if (!isUsable(answered.patch.fit.status))
      continue;
    answered.patch.radius_m = patch.radius_m;
    answered.id = patch.id;
    answered.views = patch.epochs;
    answered.is_seen_now = patch.last_seen == map.frames();
    answer.patches.push_back(std::move(answered));
  }
}

} // namespace holdfast::robot
