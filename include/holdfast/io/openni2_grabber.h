/// \file Clouds from a live depth camera, or from a recording of one, through OpenNI2.
#pragma once

#include <holdfast/io/range_frame.h>
#include <holdfast/sensor/noise_model.h>

#include <pcl/io/grabber.h>

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace holdfast {

/// How a recording is played.
enum class Playback {
  RecordedSpeed, ///< as it was taken; a slow consumer misses frames, as it would live
  EveryFrame, ///< each frame in turn, as fast as the callbacks return
};

struct Openni2Options {
  /// Empty: the first camera; "#N" or "N": the N-th, from 1; the path of an .oni file;
  /// else the URI of a device (listOpenni2Devices).
  std::string device;
  /// Size and rate of the images: 640 x 480 and 320 x 240 at 30 Hz are the usual ones.
  /// A recording has its own.
  int width = 640;
  int height = 480;
  int frames_per_second = 30;
  /// Colour too, if the camera has it in the size of the depth image.
  bool color = true;
  /// Lets the camera move its depth onto the pixels of the colour image. Without it
  /// depth is what was measured, and the colour of a point is a little beside it.
  bool registration = false;
  /// The pinhole camera of the (registered) depth image; by default it is made from the
  /// field of view that the device reports. Needed to play a registered recording: the
  /// file does not tell that it is one.
  std::optional<Camera> camera;
  /// Fills the covariances of the clouds. Null: they stay empty, and whoever fits
  /// patches evaluates the noise model for the points he uses, which is cheaper.
  NoiseModel::ConstPtr noise;
  Playback playback = Playback::RecordedSpeed;
  /// The device has stalled when no frame came for this many frame periods.
  int stall_periods = 60;
  /// After a failure, open the device again as soon as it is there.
  bool reconnect = true;
};

/// Something the application should know about.
struct GrabberEvent {
  enum class Kind {
    Unplugged,
    Stalled, ///< no frame for Openni2Options::stall_periods
    DeviceError, ///< the device says so itself, or cannot be read
    Recovered, ///< frames again, after one of the above
    EndOfRecording, ///< the last frame of the file was delivered; start() repeats it
    RecordingFailed, ///< the file that was being written is not complete
    CallbackFailed, ///< a callback threw an exception; the frame counts as delivered
  };
  Kind kind;
  std::string message; ///< one sentence
};

struct GrabberStatistics {
  std::uint64_t delivered = 0; ///< frames
  std::uint64_t dropped = 0; ///< frames that the device counted and no callback saw
  std::uint64_t failures = 0; ///< unplugged, stalled, device error
};

struct Openni2DeviceInfo {
  std::string uri;
  std::string vendor;
  std::string name;
};

/// The cameras that OpenNI2 sees, without recordings.
/// \throw pcl::IOException when OpenNI2 finds no driver at all.
std::vector<Openni2DeviceInfo> listOpenni2Devices();

/// A pcl::Grabber for depth cameras and .oni recordings. It provides
///
///     void(const pcl::PointCloud<pcl::PointXYZ>::ConstPtr&)
///     void(const pcl::PointCloud<pcl::PointXYZRGBA>::ConstPtr&)    cameras with colour
///     void(const holdfast::RangeFrame::ConstPtr&)
///     void(const holdfast::GrabberEvent&)
///
/// Clouds are organized, in metres, in the camera frame, never mirrored; NaN where
/// nothing was measured. A point has the newest colour image taken at most half a
/// period before the depth, for which the depth waits one period if need be.
///
/// All callbacks run on one thread of the grabber, except RecordingFailed where
/// the deletion of the grabber ends the recording. While they run, newer frames replace
/// older ones: a slow consumer gets the newest, and statistics() counts the others.
/// Events that nobody is registered for are printed with PCL_WARN.
///
/// Any function may be called from any thread, also from a callback, where stop() takes
/// effect when the callback returns. The grabber may even be deleted there; the device
/// is then closed when the callback returns. No further callback is made for the same
/// frame in either case.
class Openni2Grabber : public pcl::Grabber {
public:
  /// Opens the device. A recording whose writer was killed is good up to its last
  /// complete frame. Colour is read from recordings only where it is not compressed.
  /// \throw pcl::IOException when there is no such device, it has no depth sensor or
  /// not this mode, cannot register, or the file is no recording or damaged. \throw
  /// std::invalid_argument when the options make no sense.
  explicit Openni2Grabber(const Openni2Options& options = {});
  ~Openni2Grabber() noexcept override;

  /// No effect when running. After the end of a recording it starts from the beginning.
  /// \throw pcl::IOException when the device does not start.
  void start() override;

  /// When it returns, no callback runs any more (but see above for callbacks).
  void stop() override;

  /// False also when the recording has ended or the device has failed for good.
  bool isRunning() const override;
  std::string getName() const override;
  float getFramesPerSecond() const override; ///< of the chosen mode, Hz

  /// The pinhole camera on whose pixels the points lie.
  Camera camera() const;
  bool hasColor() const;
  GrabberStatistics statistics() const;

  /// Writes all that the camera delivers, also what no callback sees, to an .oni file
  /// without loss: from when the writer is ready, moments later, until stopRecording(),
  /// which makes the file complete, or a failure of the device. OpenNI2 can do that for
  /// one grabber at a time.
  /// \throw pcl::IOException when a recording runs or is being played, the device is
  /// gone, or the file cannot be written.
  void startRecording(const std::string& path);

  /// No effect when nothing is being recorded.
  /// \throw pcl::IOException when the file did not come out complete (full disk).
  void stopRecording();

private:
  class Impl;
  std::shared_ptr<Impl> impl_; ///< outlives the grabber on its thread
};

} // namespace holdfast
