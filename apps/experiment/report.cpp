#include "report.h"

#include "console.h"

#include <algorithm>

namespace holdfast::app {
namespace {

std::string
cellText(const Json& row, const std::string& key)
{
  const auto found = row.find(key);
  if (found == row.end() || found->is_null())
    return "-";
  if (found->is_string())
    return found->get<std::string>();
  if (found->is_number_float())
    return formatNumber("%.3g", found->get<double>());
  return found->dump();
}

/// Objects within a row become keys of their own.
Json
flattened(const Json& row)
{
  Json flat = Json::object();
  for (const auto& [key, value] : row.items()) {
    if (!value.is_object()) {
      flat[key] = value;
      continue;
    }
    for (const auto& [name, entry] : value.items())
      flat[key + "." + name] = entry;
  }
  return flat;
}

std::string
csvText(const Json& value)
{
  if (value.is_null())
    return {};
  if (!value.is_string())
    return value.dump();
  std::string quoted = "\"";
  for (const char c : value.get<std::string>())
    quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + "\"";
}

} // namespace

std::string
reportText(const Report& report)
{
  std::vector<std::vector<std::string>> table(1);
  for (const Column& column : report.columns)
    table.front().push_back(column.heading);
  for (const Json& row : report.summary.empty() ? report.rows : report.summary) {
    std::vector<std::string>& cells = table.emplace_back();
    for (const Column& column : report.columns) {
      std::string text = cellText(row, column.key);
      if (!column.variance_key.empty() && text != "-")
        text += " (" + cellText(row, column.variance_key) + ")";
      cells.push_back(text);
    }
  }
  std::string text = formatTable(table);
  for (const std::string& remark : report.remarks)
    text += "\n" + remark + "\n";
  return text;
}

void
writeCsv(std::ostream& out, const std::vector<Json>& rows)
{
  std::vector<Json> flat;
  std::vector<std::string> keys;
  for (const Json& row : rows) {
    flat.push_back(flattened(row));
    for (const auto& item : flat.back().items())
      if (std::find(keys.begin(), keys.end(), item.key()) == keys.end())
        keys.push_back(item.key());
  }
  for (std::size_t j = 0; j < keys.size(); ++j)
    out << (j == 0 ? "" : ",") << keys[j];
  out << '\n';
  for (const Json& row : flat) {
    for (std::size_t j = 0; j < keys.size(); ++j)
      out << (j == 0 ? "" : ",") << csvText(row.value(keys[j], Json()));
    out << '\n';
  }
}

} // namespace holdfast::app
