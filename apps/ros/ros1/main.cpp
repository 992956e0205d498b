#include "ros1/node.h"

#include <csignal>
#include <cstdlib>
#include <exception>
#include <iostream>

namespace {

extern "C" void
stop(int /*signal*/)
{
  ros::requestShutdown();
}

/// ROS has a handler for Ctrl-C alone. A terminal that closes, and systems that end
/// what they began, are to leave nothing behind either.
void
stopOnSignals()
{
  struct sigaction action {};
  action.sa_handler = stop;
  ::sigaction(SIGINT, &action, nullptr);
  ::sigaction(SIGTERM, &action, nullptr);
  struct sigaction hangup {};
  ::sigaction(SIGHUP, nullptr, &hangup);
  if (hangup.sa_handler != SIG_IGN) // as nohup has it
    ::sigaction(SIGHUP, &action, nullptr);
}

} // namespace

int
main(int argc, char** argv)
{
  ros::init(argc, argv, "holdfast", ros::init_options::NoSigintHandler);
  stopOnSignals();
  try {
    const holdfast::robot::Node node;
    ros::spin();
  }
  catch (const std::exception& error) {
    // What ROS prints with has gone with the node.
    std::cerr << "holdfast_node: " << error.what() << '\n';
    return EXIT_FAILURE;
  }
  return EXIT_SUCCESS;
}
