/// \file What the sub-commands share in talking to the user.
///
/// Results go to standard output, everything else to standard error.
#pragma once

#include <chrono>
#include <functional>
#include <string>
#include <vector>

namespace holdfast::app {

/// "holdfast: MESSAGE" on standard error.
void printError(const std::string& message);

/// "holdfast: note: MESSAGE" on standard error.
void printNotice(const std::string& message);

/// Calls work(FILE) for every cloud; a folder stands for the clouds in it, by name. A
/// file whose work throws, or returns false after having said why, does not stop the
/// others.
/// \return the exit code: 0, or 1 when any failed.
int forEachCloud(const std::vector<std::string>& paths,
                 const std::function<bool(const std::string&)>& work);

/// A line that is written over in place; nothing at all where standard error is no
/// terminal.
class StatusLine {
public:
  explicit StatusLine(bool enabled);
  ~StatusLine(); ///< wipes the line away
  StatusLine(const StatusLine&) = delete;
  StatusLine& operator=(const StatusLine&) = delete;

  void show(const std::string& text);
  void wipe();

private:
  bool enabled_;
  bool is_shown_ = false;
};

/// A bar in a status line.
class ProgressBar {
public:
  ProgressBar(std::string label, bool enabled);

  void update(int done, int total);

private:
  std::string label_;
  StatusLine line_;
  int percent_ = -1;
};

/// Milliseconds since it was made.
class Stopwatch {
public:
  double milliseconds() const;

private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

/// Rows of text as columns of equal width: the first flush left, the others right.
std::string formatTable(const std::vector<std::vector<std::string>>& rows);

/// printf of one number.
std::string formatNumber(const char* format, double value);

} // namespace holdfast::app
