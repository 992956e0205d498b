#include "report/risk_data.h"

#include "render/risk_colors.h"

#include <holdfast/contact/names.h>

#include <fmt/core.h>

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace holdfast::app {
namespace {

using Json = nlohmann::json;

/// A number of a foothold that the table can show.
struct FootholdColumn {
  const char* name;
  double (*value)(const Foothold&, const ContactQuality&);
};

const FootholdColumn kFootholdColumns[] = {
    {"total", [](const Foothold&, const ContactQuality& q) { return q.risk.total; }},
    {"slip", [](const Foothold&, const ContactQuality& q) { return q.risk.slip; }},
    {"height", [](const Foothold&, const ContactQuality& q) { return q.risk.height; }},
    {"tilt", [](const Foothold&, const ContactQuality& q) { return q.risk.tilt; }},
    {"gap", [](const Foothold&, const ContactQuality& q) { return q.risk.gap; }},
    {"support",
     [](const Foothold&, const ContactQuality& q) { return q.risk.support; }},
    {"joint", [](const Foothold&, const ContactQuality& q) { return q.risk.joint; }},
    {"cvar_gap", [](const Foothold&, const ContactQuality& q) { return q.cvar_gap_m; }},
    {"contact_area",
     [](const Foothold&, const ContactQuality& q) { return q.contact_area_m2; }},
    {"support_share",
     [](const Foothold& f, const ContactQuality&) { return f.risk.support_share; }},
    {"yaw", [](const Foothold& f, const ContactQuality&) { return f.placement.yaw; }},
    {"views", [](const Foothold& f, const ContactQuality&) { return double(f.views); }},
};

std::string
hex(const Rgb& color)
{
  return fmt::format("#{:02x}{:02x}{:02x}", color[0], color[1], color[2]);
}

Json
columnsJson(const std::vector<Foothold>& footholds, BinaryBlock& block)
{
  Json columns = Json::object();
  for (const FootholdColumn& column : kFootholdColumns) {
    std::vector<float> numbers;
    for (const Foothold& foothold : footholds)
      numbers.push_back(
          static_cast<float>(column.value(foothold, *foothold.risk.quality)));
    columns[column.name] = block.add(numbers);
  }
  return columns;
}

/// Of each sole its corners, their middle and its toe, m.
std::vector<float>
solePoints(const std::vector<PictureSole>& soles)
{
  std::vector<float> numbers;
  const auto append = [&](const Eigen::Vector3d& point) {
    for (const double coordinate : point)
      numbers.push_back(static_cast<float>(coordinate));
  };
  for (const PictureSole& sole : soles) {
    for (const Eigen::Vector3d& corner : sole.corners)
      append(corner);
    append(sole.middle);
    append(sole.toe);
  }
  return numbers;
}

/// Rows of the patches that footholds are on.
std::vector<float>
rowsOf(const RiskResult& risk)
{
  std::map<std::uint64_t, std::size_t> by_id;
  for (std::size_t i = 0; i < risk.patches.size(); ++i)
    by_id[risk.patches[i].id] = i;
  std::vector<float> rows;
  for (const Foothold& foothold : risk.footholds)
    rows.push_back(static_cast<float>(by_id.at(foothold.patch)));
  return rows;
}

} // namespace

Json
riskJson(const ReportResult& result, BinaryBlock& block)
{
  if (!result.risk)
    return nullptr;
  const RiskResult& risk = *result.risk;
  std::vector<std::uint8_t> statuses;
  for (const TriedPatch& tried : risk.patches)
    statuses.push_back(static_cast<std::uint8_t>(tried.status));
  const std::size_t corners = risk.soles.empty() ? 0 : risk.soles[0].corners.size();
  return {{"head", risk.head},
          {"statusNames", kContactStatusNames.words},
          {"statuses", block.add(statuses)},
          {"footholds", risk.footholds.size()},
          {"rows", block.add(rowsOf(risk))},
          {"corners", corners},
          {"soles", block.add(solePoints(risk.soles))},
          {"columns", columnsJson(risk.footholds, block)}};
}

Json
riskScaleJson()
{
  Json colors = Json::array();
  for (const Rgb& color : kRiskColors)
    colors.push_back(hex(color));
  return {{"least", kLeastRisk}, {"colors", colors}, {"none", hex(kNoSupport)}};
}

} // namespace holdfast::app
