/// \file The results that a report is about.
#pragma once

#include "result_input.h"
#include "risk_result.h"

#include <nlohmann/json.hpp>

#include <optional>
#include <string>
#include <vector>

namespace holdfast::app {

/// One result: of a cloud, a frame or a map, or where a foot may step on one.
struct ReportResult {
  std::string source; ///< file it was read from
  PatchReport report;
  nlohmann::json head; ///< the members of its JSON but for the patches
  /// Of every patch: numbers that a PatchReport does not hold, such as "views" of a
  /// map's patches and the total "risk" of a foot there.
  std::vector<nlohmann::json> extras;
  bool has_fits = true; ///< false: of the patches no more than shapes are known
  std::optional<RiskResult> risk; ///< its patches one by one those of the report
  std::optional<SeenCloud> cloud;
  std::string cloud_file; ///< empty without a cloud
  std::string cloud_note; ///< why there is none; may be empty
};

/// Reads a file as holdfast fit, map, live and risk write them: one JSON object, or one
/// in every line. Clouds are not loaded yet.
/// \throw std::runtime_error "PATH: cause".
std::vector<ReportResult> readReportResults(const std::string& path);

/// Gives maps what `holdfast risk` has found on them: a risk that is of exactly the
/// patches of a map's result beside it becomes part of that; others stay as they are.
void joinRisks(std::vector<ReportResult>& results);

/// Whether the result says which file its points are in.
bool namesCloud(const ReportResult& result);

/// Gives the result its cloud: `cloud`, or where that is empty the one it names, if it
/// is a file. \param notices receives one line each. \throw std::runtime_error "PATH:
/// cause", not when the named cloud is nowhere.
void addCloud(ReportResult& result,
              const std::string& cloud,
              const InputOptions& input,
              std::vector<std::string>& notices);

/// The cloud, or where there is none the middles of the patches, and the sensor.
SeenCloud seenOf(const ReportResult& result);

/// False for what a map knows too little of.
bool hasShape(const ExtractedPatch& patch);

/// "rocks.pcd".
std::string titleOf(const ReportResult& result);

} // namespace holdfast::app
