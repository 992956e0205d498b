/// \file What an experiment gives back, and its forms: table, CSV, JSON.
#pragma once

#include "plot.h"

#include <nlohmann/json.hpp>

#include <ostream>
#include <string>
#include <vector>

namespace holdfast::app {

/// Keeps the order in which keys are added.
using Json = nlohmann::ordered_json;

/// A column of the printed table.
struct Column {
  std::string heading;
  std::string key; ///< in the rows
  std::string variance_key = {}; ///< if not empty, printed behind it in brackets
};

struct Report {
  /// Objects; values are numbers, strings, null (does not apply) or objects of numbers
  /// by name. Keys and units are the same in all rows.
  std::vector<Json> rows;
  /// What people see; CSV and JSON hold all keys.
  std::vector<Column> columns;
  /// Rows of the printed table, where those above are too many; empty: those above.
  std::vector<Json> summary;
  /// Sentences below the table.
  std::vector<std::string> remarks;
  Plot plot; ///< no panel: none is written
};

/// The table and the remarks.
std::string reportText(const Report& report);

/// One line of headings, one per row; objects spread over columns KEY.NAME. Numbers
/// survive the way to text and back; what does not apply is empty.
void writeCsv(std::ostream& out, const std::vector<Json>& rows);

} // namespace holdfast::app
