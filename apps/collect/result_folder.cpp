#include "result_folder.h"

#include "patch_line.h"

#include "fit/hash.h"

#include <nlohmann/json.hpp>

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <optional>
#include <stdexcept>

namespace holdfast::app {
namespace {

namespace fs = std::filesystem;

/// Rows that are handed on at once.
constexpr std::size_t kBlock = 512;

struct Ending {
  std::string_view text;
  SourceKind kind;
};

constexpr std::array kEndings{Ending{".patches.json", SourceKind::Json},
                              Ending{".patches.h5", SourceKind::Columns},
                              Ending{".failed.json", SourceKind::Failure}};

std::optional<ResultSource>
sourceOf(const fs::directory_entry& entry)
{
  const std::string file = entry.path().filename().string();
  for (const Ending& ending : kEndings) {
    if (file.size() <= ending.text.size() ||
        file.compare(file.size() - ending.text.size(), file.size(), ending.text) != 0)
      continue;
    const std::string name = file.substr(0, file.size() - ending.text.size());
    const auto changed = entry.last_write_time().time_since_epoch().count();
    return ResultSource{
        name,
        entry.path().string(),
        ending.kind,
        stableHash(fmt::format("{}\n{} {}", file, entry.file_size(), changed))};
  }
  return std::nullopt;
}

std::ifstream
openText(const std::string& path)
{
  errno = 0;
  std::ifstream file(path, std::ios::binary);
  if (!file)
    throw std::runtime_error(std::string("cannot be read: ") + std::strerror(errno));
  return file;
}

/// A result has one patch per line between two lines of its own.
void
readJsonSource(const ResultSource& source, const ResultSink& sink)
{
  std::ifstream file = openText(source.path);
  const std::string begin = "\"patches\":[";
  std::string head, line;
  while (std::getline(file, line) && line != begin)
    head += line + '\n';
  if (line != begin)
    throw std::runtime_error("has not a patch per line, as the files of fit -o have");
  // The head ends with a comma.
  sink.cloud(cloudRowOf(source.name, head + "\"patches\":[]}"));
  std::vector<PatchRow> rows;
  bool is_complete = false;
  while (!is_complete && std::getline(file, line)) {
    if (line == "],") {
      is_complete = true;
      continue;
    }
    if (line.empty())
      continue;
    if (line.back() == ',')
      line.pop_back();
    rows.push_back(rowOfJson(line));
    if (rows.size() == kBlock) {
      sink.patches(rows.data(), rows.size());
      rows.clear();
    }
  }
  if (!is_complete)
    throw std::runtime_error("ends among its patches");
  sink.patches(rows.data(), rows.size());
}

void
readColumnSource(const ResultSource& source, const ResultSink& sink)
{
  const auto reader = columnFormat().open(source.path);
  std::vector<PatchRow> rows;
  for (const CloudRow& cloud : reader->clouds()) {
    sink.cloud(cloud);
    for (std::uint64_t i = 0; i < cloud.patches; i += kBlock) {
      const auto count = std::min<std::uint64_t>(kBlock, cloud.patches - i);
      reader->readPatches(cloud.first_patch + i, count, rows);
      if (rows.size() != count)
        throw std::runtime_error("ends among its patches");
      sink.patches(rows.data(), rows.size());
    }
  }
}

void
readFailure(const ResultSource& source, const ResultSink& sink)
{
  std::ifstream file = openText(source.path);
  try {
    const auto json = nlohmann::json::parse(file);
    sink.failure({source.name,
                  json.at("cloud"),
                  json.value("fingerprint", ""),
                  json.at("reason")});
  }
  catch (const nlohmann::json::exception& error) {
    throw std::runtime_error(std::string("no record of a failure: ") + error.what());
  }
}

} // namespace

std::vector<ResultSource>
resultsIn(const std::string& folder)
{
  std::vector<ResultSource> sources;
  std::error_code error;
  for (fs::directory_iterator it(folder, error), end; !error && it != end;
       it.increment(error))
    if (it->is_regular_file())
      if (auto source = sourceOf(*it))
        sources.push_back(std::move(*source));
  if (error)
    throw std::runtime_error(folder + ": cannot be listed: " + error.message());
  if (sources.empty())
    throw std::runtime_error(folder + ": holds no results of holdfast fit -o");
  const auto by_name = [](const ResultSource& a, const ResultSource& b) {
    return a.name < b.name;
  };
  std::sort(sources.begin(), sources.end(), by_name);
  const auto twice = std::adjacent_find(
      sources.begin(),
      sources.end(),
      [](const ResultSource& a, const ResultSource& b) { return a.name == b.name; });
  if (twice != sources.end())
    throw std::runtime_error(twice->path + ": and " + std::next(twice)->path +
                             " are of one cloud; fit --manifest --resume would leave "
                             "one of them");
  return sources;
}

void
readSource(const ResultSource& source, const ResultSink& sink)
{
  try {
    switch (source.kind) {
    case SourceKind::Json:
      return readJsonSource(source, sink);
    case SourceKind::Columns:
      return readColumnSource(source, sink);
    case SourceKind::Failure:
      return readFailure(source, sink);
    }
  }
  catch (const std::runtime_error& error) {
    const std::string cause = error.what();
    throw std::runtime_error(
        cause.rfind(source.path, 0) == 0 ? cause : source.path + ": " + cause);
  }
}

} // namespace holdfast::app
