#include "endings.h"

#include "console.h"

#include <holdfast/io/atomic_file.h>

#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <new>
#include <system_error>

namespace holdfast::app {
namespace {

/// Nothing is done about it if standard error cannot be written.
void
put(const char* text) noexcept
{
  const auto ignored = ::write(STDERR_FILENO, text, std::strlen(text));
  static_cast<void>(ignored);
}

/// Without allocating anything.
void
putLine(const char* subject, const char* cause) noexcept
{
  put("holdfast: ");
  if (subject != nullptr) {
    put(subject);
    put(": ");
  }
  put(cause);
  put("\n");
}

[[noreturn]] void
endByError()
{
  removeTemporaryFiles();
  if (std::current_exception())
    printCurrentError();
  else
    putLine(nullptr, "ended by an error of its own");
  std::_Exit(1);
}

} // namespace

extern "C" void
endBySignal(int signal)
{
  removeTemporaryFiles();
  std::signal(signal, SIG_DFL);
  ::raise(signal); // delivered when this handler returns
}

void
prepareForTheEnd()
{
  std::set_terminate(endByError);
  std::signal(SIGXFSZ, SIG_IGN);
  for (const int signal : {SIGHUP, SIGINT, SIGPIPE, SIGQUIT, SIGTERM, SIGXCPU}) {
    struct sigaction old {};
    ::sigaction(signal, nullptr, &old);
    if (old.sa_handler == SIG_IGN) // nohup, for one
      continue;
    struct sigaction action {};
    action.sa_handler = endBySignal;
    ::sigaction(signal, &action, nullptr);
  }
}

void
printCurrentError(const char* subject) noexcept
{
  try {
    throw;
  }
  catch (const std::bad_alloc&) {
    putLine(subject, "not enough memory");
  }
  catch (const std::system_error& error) {
    // Its text alone would not tell of what.
    if (error.code() == std::errc::resource_unavailable_try_again)
      putLine(subject, "the system has no more threads to give");
    else
      putLine(subject, error.what());
  }
  catch (const std::exception& error) {
    putLine(nullptr, error.what());
  }
  catch (...) {
    putLine(subject, "ended by an unknown error");
  }
}

} // namespace holdfast::app
