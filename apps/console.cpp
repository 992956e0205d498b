#include "console.h"

#include "endings.h"

#include <holdfast/io/cloud_io.h>

#include <fmt/printf.h>

#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <iostream>
#include <sstream>
#include <utility>

namespace holdfast::app {
namespace {

constexpr int kBarWidth = 30;

constexpr const char* kEraseRest = "\x1b[K"; // of the line

/// The clouds a path stands for.
std::vector<std::string>
cloudsOf(const std::string& path)
{
  namespace fs = std::filesystem;
  std::error_code error;
  if (!fs::is_directory(path, error))
    return {path};
  std::vector<std::string> clouds;
  for (fs::directory_iterator it(path, error), end; !error && it != end;
       it.increment(error))
    if (it->is_regular_file() && it->path().filename().string()[0] != '.' &&
        isCloudFile(it->path().string()))
      clouds.push_back(it->path().string());
  if (error)
    throw std::runtime_error(path + ": cannot be listed: " + error.message());
  if (clouds.empty())
    throw std::runtime_error(path + ": holds no cloud");
  std::sort(clouds.begin(), clouds.end());
  return clouds;
}

} // namespace

void
printError(const std::string& message)
{
  std::cerr << "holdfast: " << message << std::endl;
}

void
printNotice(const std::string& message)
{
  printError("note: " + message);
}

int
forEachCloud(const std::vector<std::string>& paths,
             const std::function<bool(const std::string&)>& work)
{
  int exit_code = 0;
  const auto attempt = [&exit_code](const std::string& subject, const auto& step) {
    try {
      if (!step())
        exit_code = 1;
    }
    catch (...) {
      printCurrentError(subject.c_str());
      exit_code = 1;
    }
  };
  for (const std::string& path : paths)
    attempt(path, [&] {
      for (const std::string& cloud : cloudsOf(path))
        attempt(cloud, [&] { return work(cloud); });
      return true;
    });
  return exit_code;
}

StatusLine::StatusLine(bool enabled) : enabled_(enabled && ::isatty(STDERR_FILENO) == 1)
{}

StatusLine::~StatusLine()
{
  wipe();
}

void
StatusLine::show(const std::string& text)
{
  if (!enabled_)
    return;
  std::cerr << '\r' << text << kEraseRest << std::flush;
  is_shown_ = true;
}

void
StatusLine::wipe()
{
  if (is_shown_)
    std::cerr << '\r' << kEraseRest << std::flush;
  is_shown_ = false;
}

ProgressBar::ProgressBar(std::string label, bool enabled)
: label_(std::move(label)), line_(enabled)
{}

void
ProgressBar::update(int done, int total)
{
  const int percent = total > 0 ? static_cast<int>(100LL * done / total) : 100;
  if (percent == percent_)
    return;
  percent_ = percent;
  const auto full = static_cast<std::size_t>(kBarWidth * percent / 100);
  line_.show(fmt::format("{} [{:<{}}] {} %",
                         label_,
                         std::string(full, '#'),
                         kBarWidth,
                         percent));
}

double
Stopwatch::milliseconds() const
{
  const std::chrono::duration<double, std::milli> elapsed =
      std::chrono::steady_clock::now() - start_;
  return elapsed.count();
}

std::string
formatTable(const std::vector<std::vector<std::string>>& rows)
{
  std::vector<std::size_t> widths;
  for (const auto& row : rows) {
    widths.resize(std::max(widths.size(), row.size()));
    for (std::size_t j = 0; j < row.size(); ++j)
      widths[j] = std::max(widths[j], row[j].size());
  }
  std::ostringstream out;
  for (const auto& row : rows) {
    for (std::size_t j = 0; j < row.size(); ++j) {
      const std::string padding(widths[j] - row[j].size(), ' ');
      out << (j == 0 ? "" : "  ") << (j == 0 ? row[j] + padding : padding + row[j]);
    }
    out << '\n';
  }
  return out.str();
}

std::string
formatNumber(const char* format, double value)
{
  return fmt::sprintf(format, value); // in the classic locale, unlike std::printf
}

} // namespace holdfast::app
