#include <holdfast/io/openni2_grabber.h>

#include "openni2_device.h"
#include "openni2_file.h"
#include "openni2_frames.h"
#include "openni2_player.h"
#include "openni2_runtime.h"

#include <pcl/console/print.h>

#include <algorithm>
#include <condition_variable>
#include <map>
#include <new>
#include <set>
#include <stdexcept>
#include <thread>
#include <utility>

namespace holdfast {

namespace {

using Clock = std::chrono::steady_clock;
using Kind = GrabberEvent::Kind;
using Status = io::FrameSource::Status;

using PointsSlot = void(const pcl::PointCloud<pcl::PointXYZ>::ConstPtr&);
using ColoredSlot = void(const pcl::PointCloud<pcl::PointXYZRGBA>::ConstPtr&);
using FrameSlot = void(const RangeFrame::ConstPtr&);
using EventSlot = void(const GrabberEvent&);

template <typename Slot>
using Signal = boost::signals2::signal<Slot>;

/// How soon the thread notices that it should stop, or that something has happened.
constexpr std::chrono::milliseconds kPatience{20};
/// How often it looks whether a lost device is back.
constexpr std::chrono::milliseconds kRetryPeriod{200};

void
check(const Openni2Options& options)
{
  if (options.width < 1 || options.height < 1 || options.frames_per_second < 1)
    throw std::invalid_argument("size and rate of the depth image must be positive");
  if (options.stall_periods < 1)
    throw std::invalid_argument("stall_periods must be at least 1");
}

Covariances
covariancesOf(const pcl::PointCloud<pcl::PointXYZ>& cloud, const NoiseModel& noise)
{
  std::vector<Eigen::Vector3d> image;
  image.reserve(cloud.size());
  for (const pcl::PointXYZ& point : cloud)
    image.emplace_back(point.getVector3fMap().cast<double>());
  return noise.imageCovariances(image,
                                static_cast<int>(cloud.width),
                                static_cast<int>(cloud.height));
}

} // namespace

/// Everything but the base class: the thread keeps it alive until it ends, wherever the
/// grabber is deleted.
class Openni2Grabber::Impl : public std::enable_shared_from_this<Impl> {
public:
  using Signals = std::map<std::string, std::unique_ptr<boost::signals2::signal_base>>;

  explicit Impl(const Openni2Options& options) : options_(options)
  {
    check(options_);
    open(io::resolveDevice(options_.device));
  }

  ~Impl()
  {
    close();
  }

  void start();
  void stop();
  /// The grabber is being deleted. \param signals its own
  void release(Signals signals);
  void startRecording(const std::string& path);
  void stopRecording();

  bool isRunning() const
  {
    return running_ && !ended_ && !stop_ && !stop_by_callback_;
  }
  io::SourceInfo info() const
  {
    const std::lock_guard<std::mutex> lock(source_mutex_);
    return info_;
  }
  GrabberStatistics statistics() const
  {
    return {delivered_, dropped_, failures_};
  }

  Signal<PointsSlot>* on_points = nullptr;
  Signal<ColoredSlot>* on_colored = nullptr;
  Signal<FrameSlot>* on_frame = nullptr;
  Signal<EventSlot>* on_event = nullptr;

private:
  bool isOwnThread() const
  {
    return std::this_thread::get_id() == thread_id_.load();
  }

  void open(const std::string& uri);
  void close();
  std::string finishRecording();

  void prepare();
  void startSource();
  void join();
  void run();
  void readOnce();
  void fail(Kind kind, const std::string& message);
  void retry();
  void end();
  void deliver(const io::Image& depth);
  void countDropped(int index);
  Clock::duration stallTime() const;

  void emit(Kind kind, const std::string& message);
  template <typename Slot, typename Argument>
  void call(const Signal<Slot>* signal, const Argument& argument);

  const Openni2Options options_;

  std::mutex lifecycle_mutex_; ///< one start() or stop() at a time
  std::mutex running_mutex_; ///< to wait for a change of isRunning() by the thread
  std::condition_variable changed_;
  std::atomic<std::thread::id> thread_id_{};
  std::atomic<bool> running_{false};
  std::atomic<bool> stop_{false};
  std::atomic<bool> stop_by_callback_{false}; ///< which start() in a callback revokes
  std::atomic<bool> ended_{false}; ///< by itself
  Signals signals_; ///< of the grabber when that is gone

  /// Guards what is below against everybody but the thread, which alone exchanges the
  /// source while it runs.
  mutable std::mutex source_mutex_;
  std::unique_ptr<io::FrameSource> source_;
  io::SourceInfo info_; ///< also of one that is lost
  std::shared_ptr<void> recorder_;
  std::string recorded_path_;

  // Of the thread alone.
  std::set<std::string> other_uris_; ///< what was there, too, when the device was lost
  io::FramePairer pairer_;
  Clock::time_point last_frame_;
  Clock::time_point next_try_;
  int last_index_ = 0; ///< 0: no frame since the start
  bool failed_ = false;

  std::atomic<std::uint64_t> delivered_{0};
  std::atomic<std::uint64_t> dropped_{0};
  std::atomic<std::uint64_t> failures_{0};
};

void
Openni2Grabber::Impl::open(const std::string& uri)
{
  std::unique_ptr<io::FrameSource> source;
  if (io::isRecordingPath(uri))
    source = std::make_unique<io::OniPlayer>(uri, options_);
  else
    source = std::make_unique<io::Openni2Device>(uri, options_);
  const std::lock_guard<std::mutex> lock(source_mutex_);
  source_ = std::move(source);
  info_ = source_->info();
}

void
Openni2Grabber::Impl::close()
{
  pairer_ = {};
  const std::string error = finishRecording();
  {
    const std::lock_guard<std::mutex> lock(source_mutex_);
    source_.reset();
  }
  if (!error.empty())
    emit(Kind::RecordingFailed, error);
}

void
Openni2Grabber::Impl::start()
{
  if (isOwnThread()) {
    if (ended_)
      prepare();
    const std::lock_guard<std::mutex> lock(running_mutex_);
    stop_by_callback_ = false;
    changed_.notify_all();
    return;
  }
  const std::lock_guard<std::mutex> lock(lifecycle_mutex_);
  join();
  if (isRunning())
    return;
  prepare();
  stop_ = stop_by_callback_ = false;
  running_ = true;
  try {
    io::runOnLastingThread([self = shared_from_this()] { self->run(); });
  }
  catch (...) {
    running_ = false; // join() must not wait for a thread that never was
    source_->stop();
    throw;
  }
}

/// Has the device deliver from now on.
void
Openni2Grabber::Impl::prepare()
{
  if (source_ && !info_.is_recording && source_->status() != Status::Ready)
    close();
  if (!source_)
    open(info_.device.uri);
  startSource();
  ended_ = failed_ = false;
}

void
Openni2Grabber::Impl::startSource()
{
  source_->start();
  pairer_ = io::FramePairer(info_);
  last_index_ = 0;
  last_frame_ = Clock::now();
}

void
Openni2Grabber::Impl::stop()
{
  if (isOwnThread()) {
    stop_by_callback_ = true;
    return;
  }
  const std::lock_guard<std::mutex> lock(lifecycle_mutex_);
  stop_ = true;
  join();
}

/// Waits for the end of a thread that should end, unless a callback revokes that.
void
Openni2Grabber::Impl::join()
{
  std::unique_lock<std::mutex> lock(running_mutex_);
  changed_.wait(lock, [this] { return !running_ || isRunning(); });
}

void
Openni2Grabber::Impl::release(Signals signals)
{
  // One of them may be calling the slot in which the grabber is deleted.
  signals_ = std::move(signals);
  stop();
  if (!isOwnThread())
    close();
}

void
Openni2Grabber::Impl::run()
{
  thread_id_ = std::this_thread::get_id();
  while (isRunning()) {
    try {
      source_ ? readOnce() : retry();
    }
    catch (const std::bad_alloc&) {
      fail(Kind::DeviceError, info_.device.uri + ": not enough memory");
    }
    catch (const std::exception& error) {
      fail(Kind::DeviceError, error.what());
    }
  }
  pairer_ = {}; // its frames must be given back on this thread
  if (source_)
    source_->stop();
  thread_id_ = std::thread::id();
  const std::lock_guard<std::mutex> lock(running_mutex_);
  running_ = false;
  changed_.notify_all();
}

void
Openni2Grabber::Impl::readOnce()
{
  const std::string& name = info_.device.uri;
  const Status status = source_->status();
  if (status == Status::Unplugged)
    return fail(Kind::Unplugged, name + " was unplugged");
  if (status == Status::Error)
    return fail(Kind::DeviceError, name + " reports an error");
  if (status == Status::Ended)
    return end();
  const io::Image image = source_->read(kPatience);
  if (image.pixels) {
    if (std::exchange(failed_, false))
      emit(Kind::Recovered, name + " delivers frames again");
    deliver(pairer_.push(image));
    last_frame_ = Clock::now(); // however long the callbacks took
  }
  else if (!info_.is_recording && Clock::now() - last_frame_ > stallTime())
    fail(Kind::Stalled, name + " delivers no frames");
}

Clock::duration
Openni2Grabber::Impl::stallTime() const
{
  return std::chrono::milliseconds(1000LL * options_.stall_periods /
                                   info_.frames_per_second);
}

void
Openni2Grabber::Impl::fail(Kind kind, const std::string& message)
{
  close();
  ended_ = info_.is_recording || !options_.reconnect;
  if (std::exchange(failed_, true))
    return; // a failed attempt to reconnect is no news
  ++failures_;
  other_uris_.clear();
  if (!ended_)
    for (const Openni2DeviceInfo& other : listOpenni2Devices())
      other_uris_.insert(other.uri);
  emit(kind, message);
}

void
Openni2Grabber::Impl::retry()
{
  std::this_thread::sleep_for(kPatience);
  if (Clock::now() < next_try_)
    return;
  next_try_ = Clock::now() + kRetryPeriod;
  for (const Openni2DeviceInfo& candidate : listOpenni2Devices()) {
    // On another USB port, or just plugged in again, the camera may have a new URI.
    const bool is_new_of_this_kind = candidate.vendor == info_.device.vendor &&
                                     candidate.name == info_.device.name &&
                                     other_uris_.count(candidate.uri) == 0;
    if (candidate.uri != info_.device.uri && !is_new_of_this_kind)
      continue;
    open(candidate.uri);
    return startSource();
  }
}

void
Openni2Grabber::Impl::end()
{
  deliver(pairer_.flush());
  ended_ = true;
  emit(Kind::EndOfRecording,
       info_.device.uri +
           (info_.is_cut_off ? " breaks off: it was not closed" : " has ended"));
}

void
Openni2Grabber::Impl::countDropped(int index)
{
  if (last_index_ > 0 && index > last_index_ + 1)
    dropped_ += static_cast<std::uint64_t>(index - last_index_ - 1);
  last_index_ = index;
}

void
Openni2Grabber::Impl::deliver(const io::Image& depth)
{
  if (!depth.pixels || !isRunning())
    return;
  countDropped(depth.index);
  ++delivered_;
  const bool wants_frames = !on_frame->empty();
  if (!wants_frames && on_points->empty() && on_colored->empty())
    return;
  auto frame = std::make_shared<RangeFrame>();
  frame->camera = info_.camera;
  const auto points = io::depthToCloud(depth, frame->camera);
  frame->cloud.points = points;
  frame->timestamp_us = depth.timestamp_us;
  frame->index = depth.index;
  frame->received = depth.received;
  if (pairer_.color().pixels && (wants_frames || !on_colored->empty()))
    frame->colored = io::colorCloud(*points, pairer_.color());
  if (wants_frames && options_.noise)
    frame->cloud.covariances =
        std::make_shared<const Covariances>(covariancesOf(*points, *options_.noise));
  call(on_points, frame->cloud.points);
  if (frame->colored)
    call(on_colored, frame->colored);
  call(on_frame, RangeFrame::ConstPtr(frame));
}

template <typename Slot, typename Argument>
void
Openni2Grabber::Impl::call(const Signal<Slot>* signal, const Argument& argument)
{
  if (stop_by_callback_)
    return; // which may have deleted the grabber
  try {
    (*signal)(argument);
  }
  catch (const std::exception& error) {
    emit(Kind::CallbackFailed, std::string("a callback threw: ") + error.what());
  }
}

void
Openni2Grabber::Impl::emit(Kind kind, const std::string& message)
{
  if (on_event == nullptr || on_event->empty()) {
    PCL_WARN("[Openni2Grabber] %s\n", message.c_str());
    return;
  }
  try {
    (*on_event)({kind, message});
  }
  catch (const std::exception& error) {
    PCL_ERROR("[Openni2Grabber] a callback for events threw: %s\n", error.what());
  }
}

void
Openni2Grabber::Impl::startRecording(const std::string& path)
{
  const std::lock_guard<std::mutex> lock(source_mutex_);
  if (recorder_)
    throw io::Openni2Error("a recording is already being written: " + recorded_path_);
  if (!source_)
    throw io::Openni2Error("there is no camera to record");
  recorder_ = source_->recordTo(path);
  recorded_path_ = path;
}

/// \return what is wrong with the file; empty when it is good or there is none.
std::string
Openni2Grabber::Impl::finishRecording()
{
  const std::lock_guard<std::mutex> lock(source_mutex_);
  if (!recorder_)
    return {};
  recorder_.reset();
  try {
    const bool is_closed = io::readOniFile(recorded_path_).is_closed;
    return is_closed ? std::string() :
                       recorded_path_ + ": frames are missing, is the disk full?";
  }
  catch (const pcl::IOException& error) {
    return error.what();
  }
}

void
Openni2Grabber::Impl::stopRecording()
{
  if (const std::string error = finishRecording(); !error.empty())
    throw io::Openni2Error(error);
}

Openni2Grabber::Openni2Grabber(const Openni2Options& options)
: impl_(std::make_shared<Impl>(options))
{
  impl_->on_points = createSignal<PointsSlot>();
  impl_->on_colored = createSignal<ColoredSlot>();
  impl_->on_frame = createSignal<FrameSlot>();
  impl_->on_event = createSignal<EventSlot>();
}

Openni2Grabber::~Openni2Grabber() noexcept
{
  impl_->release(std::move(signals_));
}

void
Openni2Grabber::start()
{
  impl_->start();
}

void
Openni2Grabber::stop()
{
  impl_->stop();
}

bool
Openni2Grabber::isRunning() const
{
  return impl_->isRunning();
}

std::string
Openni2Grabber::getName() const
{
  return "Openni2Grabber";
}

float
Openni2Grabber::getFramesPerSecond() const
{
  return static_cast<float>(impl_->info().frames_per_second);
}

Camera
Openni2Grabber::camera() const
{
  return impl_->info().camera;
}

bool
Openni2Grabber::hasColor() const
{
  return impl_->info().has_color;
}

GrabberStatistics
Openni2Grabber::statistics() const
{
  return impl_->statistics();
}

void
Openni2Grabber::startRecording(const std::string& path)
{
  impl_->startRecording(path);
}

void
Openni2Grabber::stopRecording()
{
  impl_->stopRecording();
}

} // namespace holdfast
