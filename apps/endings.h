/// \file How the program ends when it does not end by itself.
#pragma once

namespace holdfast::app {

/// Has signals that end the program remove unfinished files first, and errors that
/// nobody catches end it with one line and exit code 1. A limit on the size of files is
/// met as an error of writing, as a full disk is. To be called once, at the start.
void prepareForTheEnd();

/// Ends the program as `signal` does by default, without leaving unfinished files. A
/// handler of signals.
extern "C" void endBySignal(int signal);

/// One line on standard error about the exception being handled, also where there is no
/// memory to put it together. \param subject what the work was about, such as a file;
/// named before the cause where that does not name it. May be null.
void printCurrentError(const char* subject = nullptr) noexcept;

} // namespace holdfast::app
