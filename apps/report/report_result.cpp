#include "report/report_result.h"

#include "io/json_split.h"

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <map>
#include <stdexcept>
#include <string_view>

namespace holdfast::app {
namespace {

using Json = nlohmann::json;

/// One text for each object: a file of lines is one whose first line is an object.
std::vector<std::string>
objectsOf(const std::string& text)
{
  std::size_t end = text.find('\n');
  const std::string_view first = std::string_view(text).substr(0, end);
  const std::size_t last = first.find_last_not_of(" \t\r");
  if (last == std::string_view::npos || last == 0 || first[last] != '}')
    return {text};
  std::vector<std::string> objects;
  for (std::size_t begin = 0; begin < text.size(); begin = end + 1) {
    end = std::min(text.find('\n', begin), text.size());
    std::string line = text.substr(begin, end - begin);
    if (line.find_first_not_of(" \t\r") != std::string::npos)
      objects.push_back(std::move(line));
  }
  return objects;
}

/// The numbers of a patch that tell something a table can show.
Json
extrasOf(const Json& patch)
{
  Json extras = Json::object();
  const auto take = [&](const Json& from, const char* name) {
    if (const auto at = from.find(name); at != from.end() && at->is_number())
      extras[name] = *at;
  };
  if (const auto map = patch.find("map"); map != patch.end() && map->is_object())
    for (const char* name :
         {"id", "views", "independent_views", "last_seen", "conflicts", "roughness"})
      take(*map, name);
  return extras;
}

/// parseResult() has already understood the text.
void
readRest(const std::string& text, ReportResult& result)
{
  if (const auto split = io::splitJsonArray(text, "patches")) {
    result.head = Json::parse(split->rest);
    for (const std::string_view patch : split->elements)
      result.extras.push_back(extrasOf(Json::parse(patch)));
  }
  else {
    result.head = Json::parse(text);
    for (const Json& patch : result.head.at("patches"))
      result.extras.push_back(extrasOf(patch));
  }
  result.head.erase("patches");
}

void
addRisk(const TriedPatch& tried, Json& extras)
{
  if (tried.total)
    extras["risk"] = *tried.total;
}

/// What a page shows of a result of `holdfast risk`.
ReportResult
riskReport(const std::string& path, const std::string& text)
{
  ReportResult result;
  result.source = path;
  result.has_fits = false;
  try {
    result.risk = readRiskResult(text);
  }
  catch (const std::runtime_error& error) {
    throw std::runtime_error(path + ": " + error.what());
  }
  const RiskResult& risk = *result.risk;
  result.report.cloud = risk.source;
  result.report.is_of_map = risk.is_of_map;
  result.report.offset = risk.offset;
  result.report.file = risk.file;
  result.report.sensor_pose = risk.sensor_pose;
  for (const TriedPatch& tried : risk.patches) {
    result.report.result.patches.push_back(tried.patch);
    Json& extras = result.extras.emplace_back(Json::object());
    extras["id"] = tried.id;
    addRisk(tried, extras);
  }
  result.head = {{"sensor", risk.head.value("sensor", Json::object())}};
  return result;
}

ReportResult
reportOf(const std::string& path, const std::string& text)
{
  if (isRiskResult(text))
    return riskReport(path, text);
  ReportResult result;
  result.source = path;
  result.report = parseResult(path, text);
  readRest(text, result);
  return result;
}

/// Whether these are the same patch of the same map.
bool
isSame(const ExtractedPatch& patch, const Json& extras, const TriedPatch& tried)
{
  constexpr double kRounding = 1e-9; // m
  if (extras.value("id", Json()) != Json(tried.id))
    return false;
  const FitResult &a = patch.fit, &b = tried.patch.fit;
  return !isUsable(a.status) || !isUsable(b.status) ||
         (a.patch.c - b.patch.c).norm() <= kRounding;
}

/// The patches of a risk in the order of a map's; nothing when they are not the same.
std::optional<std::vector<TriedPatch>>
inOrderOf(const ReportResult& map, const RiskResult& risk)
{
  const auto& patches = map.report.result.patches;
  if (!map.report.is_of_map || map.risk || patches.size() != risk.patches.size())
    return std::nullopt;
  std::map<std::uint64_t, const TriedPatch*> by_id;
  for (const TriedPatch& tried : risk.patches)
    by_id[tried.id] = &tried;
  std::vector<TriedPatch> ordered;
  for (std::size_t i = 0; i < patches.size(); ++i) {
    const auto found = by_id.find(map.extras[i].value("id", std::uint64_t{0}));
    if (found == by_id.end() || !isSame(patches[i], map.extras[i], *found->second))
      return std::nullopt;
    ordered.push_back(*found->second);
  }
  return ordered;
}

} // namespace

std::vector<ReportResult>
readReportResults(const std::string& path)
{
  std::vector<ReportResult> results;
  for (const std::string& text : objectsOf(readResultText(path))) {
    try {
      results.push_back(reportOf(path, text));
    }
    catch (const Json::exception& error) {
      throw std::runtime_error(path + ": no result of holdfast: " + error.what());
    }
  }
  return results;
}

void
joinRisks(std::vector<ReportResult>& results)
{
  const auto hasJoined = [&](ReportResult& alone) {
    if (alone.has_fits)
      return false;
    for (ReportResult& map : results)
      if (auto ordered = inOrderOf(map, *alone.risk)) {
        map.risk = std::move(alone.risk);
        map.risk->patches = std::move(*ordered);
        for (std::size_t i = 0; i < map.extras.size(); ++i)
          addRisk(map.risk->patches[i], map.extras[i]);
        return true;
      }
    return false;
  };
  std::vector<ReportResult> rest;
  std::vector<bool> has_joined;
  for (ReportResult& result : results)
    has_joined.push_back(hasJoined(result));
  for (std::size_t i = 0; i < results.size(); ++i)
    if (!has_joined[i])
      rest.push_back(std::move(results[i]));
  results = std::move(rest);
}

bool
namesCloud(const ReportResult& result)
{
  return !result.report.is_of_map && (result.report.file || !result.has_fits);
}

void
addCloud(ReportResult& result,
         const std::string& cloud,
         const InputOptions& input,
         std::vector<std::string>& notices)
{
  const bool has_own = namesCloud(result);
  std::optional<std::string> path;
  if (!cloud.empty())
    path = cloud;
  else if (has_own)
    path = findCloud(result.source, result.report.cloud);
  if (!path) {
    if (has_own)
      result.cloud_note = "The cloud " + result.report.cloud +
                          " was neither in the working folder nor beside the result: "
                          "--cloud FILE tells where it is.";
    else
      result.cloud_note = "The result names no file of points: --cloud FILE adds one.";
    return;
  }
  std::vector<std::string> about;
  result.cloud = loadSeenCloud(*path, input, readingOf(result.report), about);
  result.cloud_file = *path;
  for (const std::string& notice : about)
    notices.push_back(*path + ": " + notice);
}

SeenCloud
seenOf(const ReportResult& result)
{
  if (result.cloud)
    return *result.cloud;
  PicturePoints middles;
  for (const ExtractedPatch& patch : result.report.result.patches)
    if (hasShape(patch))
      middles.positions.push_back(patch.fit.patch.c);
  return seenFrom(result.report.sensor_pose, std::move(middles));
}

bool
hasShape(const ExtractedPatch& patch)
{
  return isUsable(patch.fit.status) && validityError(patch.fit.patch).empty();
}

std::string
titleOf(const ReportResult& result)
{
  const std::string name =
      std::filesystem::path(result.report.cloud).filename().string();
  return name.empty() ? result.report.cloud : name;
}

} // namespace holdfast::app
