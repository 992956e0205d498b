#include "ros1/node.h"

#include <ros/callback_queue.h>

#include <atomic>
#include <csignal>
#include <cstdlib>
#include <exception>
#include <iostream>

namespace {

/// Atomic, since a signal may come to any thread.
std::atomic<bool> is_asked_to_stop{false};
static_assert(std::atomic<bool>::is_always_lock_free, "as signal handlers need it");

extern "C" void
noteStop(int /*signal*/)
{
  is_asked_to_stop = true;
}

/// ROS has a handler for Ctrl-C alone. A terminal that closes, and systems that end
/// what they began, are to leave nothing behind either. What does not stop when asked
/// is ended by the second time, but for a terminal, which may say it twice.
void
stopOnSignals()
{
  struct sigaction action {};
  action.sa_handler = noteStop;
  action.sa_flags = SA_RESTART;
  struct sigaction hangup {};
  ::sigaction(SIGHUP, nullptr, &hangup);
  if (hangup.sa_handler != SIG_IGN) // as nohup has it
    ::sigaction(SIGHUP, &action, nullptr);
  action.sa_flags |= static_cast<int>(SA_RESETHAND);
  ::sigaction(SIGINT, &action, nullptr);
  ::sigaction(SIGTERM, &action, nullptr);
}

/// What a node begins without a master cannot be stopped.
bool
waitForMaster()
{
  while (!is_asked_to_stop && !ros::master::check()) {
    ROS_WARN_ONCE("waiting for the master at %s", ros::master::getURI().c_str());
    ros::WallDuration(0.1).sleep();
  }
  return !is_asked_to_stop;
}

/// ros::spin(), with the end on this thread, when nothing uses the node any more; that
/// of ros::requestShutdown() would be on one of roscpp's.
void
spin()
{
  const holdfast::robot::Node node;
  while (!is_asked_to_stop && ros::ok())
    ros::getGlobalCallbackQueue()->callAvailable(ros::WallDuration(0.05));
}

} // namespace

int
main(int argc, char** argv)
{
  ros::init(argc, argv, "holdfast", ros::init_options::NoSigintHandler);
  stopOnSignals();
  try {
    if (waitForMaster())
      spin();
  }
  catch (const std::exception& error) {
    // What ROS prints with has gone with the node.
    std::cerr << "holdfast_node: " << error.what() << '\n';
    return EXIT_FAILURE;
  }
  return EXIT_SUCCESS;
}
