#include "grabber_run.h"

#include "console.h"
#include "endings.h"

#include <array>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <csignal>
#include <exception>
#include <mutex>
#include <utility>
#include <vector>

namespace holdfast::app {
namespace {

/// Atomic, since a signal may come to any thread.
std::atomic<bool> interrupted{false};
static_assert(std::atomic<bool>::is_always_lock_free, "as signal handlers need it");

extern "C" void
noteInterrupt(int signal)
{
  if (interrupted.exchange(true))
    endBySignal(signal);
}

/// Turns the signals that end a program into a note; the second one ends it. A reader
/// of our output that has gone is an error of writing, not of life and death.
class SignalGuard {
public:
  SignalGuard()
  {
    interrupted = false;
    struct sigaction action {};
    action.sa_handler = noteInterrupt;
    action.sa_flags = SA_RESTART; // no write fails because of it
    ::sigaction(SIGINT, &action, &on_interrupt_);
    ::sigaction(SIGTERM, &action, &on_termination_);
    ::sigaction(SIGHUP, nullptr, &on_hangup_);
    if (on_hangup_.sa_handler != SIG_IGN) // as nohup has it
      ::sigaction(SIGHUP, &action, nullptr);
    action.sa_handler = SIG_IGN;
    ::sigaction(SIGPIPE, &action, &on_pipe_);
  }
  ~SignalGuard()
  {
    ::sigaction(SIGINT, &on_interrupt_, nullptr);
    ::sigaction(SIGTERM, &on_termination_, nullptr);
    ::sigaction(SIGHUP, &on_hangup_, nullptr);
    ::sigaction(SIGPIPE, &on_pipe_, nullptr);
  }
  SignalGuard(const SignalGuard&) = delete;
  SignalGuard& operator=(const SignalGuard&) = delete;

private:
  struct sigaction on_interrupt_ {};
  struct sigaction on_termination_ {};
  struct sigaction on_hangup_ {};
  struct sigaction on_pipe_ {};
};

/// Stops a grabber, so that none of its threads uses what is about to go, also when an
/// exception is the reason.
class StopGuard {
public:
  explicit StopGuard(Openni2Grabber& grabber) : grabber_(grabber) {}
  ~StopGuard()
  {
    grabber_.stop();
  }
  StopGuard(const StopGuard&) = delete;
  StopGuard& operator=(const StopGuard&) = delete;

private:
  Openni2Grabber& grabber_;
};

/// What the two threads tell each other.
class Run {
public:
  Run(const RunOptions& options, const RunCallbacks& callbacks)
  : options_(options), callbacks_(callbacks)
  {}

  void onFrame(const RangeFrame::ConstPtr& frame);
  void onEvent(const GrabberEvent& event);

  /// Waits for a moment. \return the events of that time
  std::vector<GrabberEvent> wait();

  bool isOver() const
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    return over_;
  }
  void rethrow() const
  {
    if (error_)
      std::rethrow_exception(error_);
  }

private:
  void end(std::exception_ptr error = nullptr);

  const RunOptions& options_;
  const RunCallbacks& callbacks_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<GrabberEvent> events_;
  bool over_ = false;
  std::exception_ptr error_;
  int frames_ = 0; ///< of the grabber's thread alone
};

void
Run::onFrame(const RangeFrame::ConstPtr& frame)
{
  if (isOver())
    return;
  try {
    callbacks_.frame(frame);
  }
  catch (...) {
    return end(std::current_exception());
  }
  if (++frames_ == options_.frames)
    end();
}

void
Run::onEvent(const GrabberEvent& event)
{
  const std::lock_guard<std::mutex> lock(mutex_);
  events_.push_back(event);
  over_ = over_ || event.kind == GrabberEvent::Kind::EndOfRecording;
  changed_.notify_all();
}

void
Run::end(std::exception_ptr error)
{
  const std::lock_guard<std::mutex> lock(mutex_);
  over_ = true;
  error_ = std::move(error);
  changed_.notify_all();
}

std::vector<GrabberEvent>
Run::wait()
{
  std::unique_lock<std::mutex> lock(mutex_);
  changed_.wait_for(lock, options_.idle_period, [this] {
    return over_ || !events_.empty();
  });
  return std::exchange(events_, {});
}

/// \return false when the event means failure.
bool
tell(const GrabberEvent& event, const RunOptions& options)
{
  using Kind = GrabberEvent::Kind;
  switch (event.kind) {
  case Kind::Recovered:
  case Kind::EndOfRecording:
    if (!options.quiet)
      printNotice(event.message);
    return true;
  case Kind::Unplugged:
  case Kind::Stalled:
  case Kind::DeviceError:
    printError(event.message +
               (options.records_oni ? "; the recording ends here" : "") +
               (options.reconnects ? "; waiting for its return" : ""));
    return options.reconnects && !options.records_oni;
  case Kind::RecordingFailed:
  case Kind::CallbackFailed:
    break;
  }
  printError(event.message);
  return false;
}

bool
tellAll(const std::vector<GrabberEvent>& events,
        const RunOptions& options,
        StatusLine& line)
{
  bool well = true;
  for (const GrabberEvent& event : events) {
    line.wipe();
    well = tell(event, options) && well;
  }
  return well;
}

} // namespace

int
runGrabber(Openni2Grabber& grabber,
           const RunOptions& options,
           const RunCallbacks& callbacks)
{
  const SignalGuard signals;
  Run run(options, callbacks);
  const std::array<boost::signals2::scoped_connection, 2> connections{
      connectFrames(grabber, [&run](const auto& frame) { run.onFrame(frame); }),
      grabber.registerCallback(std::function<void(const GrabberEvent&)>(
          [&run](const GrabberEvent& event) { run.onEvent(event); }))};
  StatusLine line(!options.quiet);
  const Stopwatch watch;
  bool well = true;
  const StopGuard stop_at_exit(grabber);
  grabber.start();
  while (!run.isOver() && grabber.isRunning() && !interrupted && callbacks.idle() &&
         (options.seconds <= 0.0 || watch.milliseconds() < 1e3 * options.seconds)) {
    well = tellAll(run.wait(), options, line) && well;
    line.show(callbacks.status());
  }
  grabber.stop();
  well = tellAll(run.wait(), options, line) && well;
  line.wipe();
  run.rethrow();
  return well ? 0 : 1;
}

} // namespace holdfast::app
