#include "map/map_summary.h"

#include "console.h"

#include <holdfast/geometry/constants.h>
#include <holdfast/patch/types.h>

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

namespace holdfast::app {
namespace {

double
median(std::vector<double> values)
{
  if (values.empty())
    return 0.0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

std::string
registrationText(const RegistrationResult& registration)
{
  switch (registration.status) {
  case RegistrationStatus::Converged:
    break;
  case RegistrationStatus::IterationLimit:
    return "pose not found: no convergence";
  case RegistrationStatus::TooFewPairs:
    return fmt::format("pose not found: {} patches of the map seen again",
                       registration.pairs);
  case RegistrationStatus::NotObservable:
    return "pose not found: the patches do not tell it";
  }
  const JetMatrix& S = registration.covariance;
  const auto sigma = [&](int at) {
    return 1e3 * std::sqrt(S.block<3, 3>(at, at).trace());
  };
  std::string text = fmt::format("pose to {:.2f} mrad, {:.2f} mm", sigma(0), sigma(3));
  if (registration.null_space.cols() > 0)
    text += fmt::format(", {} of 6 directions not told by the patches",
                        registration.null_space.cols());
  return text;
}

/// Numbers of views that share a row: 1, 2-3, 4-7, 8-15, 16 and more.
constexpr std::array<int, 5> kViews{1, 2, 4, 8, 16};

std::size_t
rowOf(int views)
{
  std::size_t row = 0;
  while (row + 1 < kViews.size() && views >= kViews[row + 1])
    ++row;
  return row;
}

std::string
viewsText(std::size_t row)
{
  if (row + 1 == kViews.size())
    return fmt::format("{} or more", kViews[row]);
  const int last = kViews[row + 1] - 1;
  return last == kViews[row] ? fmt::format("{}", last) :
                               fmt::format("{} to {}", kViews[row], last);
}

} // namespace

std::string
frameLine(const std::string& frame,
          const FrameReport& report,
          std::size_t patches,
          double milliseconds)
{
  const UpdateReport& u = report.update;
  std::string text = fmt::format("{}: {} measured", frame, report.measurements);
  const std::pair<const char*, int> parts[] = {{"fused", u.fused},
                                               {"born", u.born},
                                               {"gated", u.gated},
                                               {"replaced", u.replaced},
                                               {"surplus", u.surplus},
                                               {"unfit", u.unfit},
                                               {"seen through", u.seen_through},
                                               {"merged", u.merged},
                                               {"split", u.split},
                                               {"forgotten", u.forgotten},
                                               {"hidden", report.hidden}};
  for (const auto& [name, count] : parts)
    if (count > 0)
      text += fmt::format(", {} {}", count, name);
  text += fmt::format("; {} patches", patches);
  if (report.registration)
    text += "; " + registrationText(*report.registration);
  return text + fmt::format("; {:.0f} ms\n", milliseconds);
}

std::string
mapTable(const PatchMap& map,
         const std::vector<FitResult>& fits,
         std::vector<double> single_sigmas_m)
{
  struct Row {
    int count = 0;
    std::vector<double> height, normal;
    std::map<SurfaceType, int> types;
  };
  std::array<Row, kViews.size()> rows;
  for (std::size_t i = 0; i < fits.size(); ++i) {
    Row& row = rows[rowOf(map.patches()[i].epochs)];
    const JetMatrix S = map.patches()[i].jet.covariance();
    ++row.count;
    row.height.push_back(std::sqrt(S(0, 0)));
    row.normal.push_back(std::sqrt(S(1, 1) + S(2, 2)));
    ++row.types[fits[i].patch.type.surface];
  }
  std::vector<std::vector<std::string>> table{
      {"independent views", "patches", "sigma height mm", "sigma normal deg", "types"}};
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const Row& row = rows[i];
    if (row.count == 0)
      continue;
    std::string types;
    for (const auto& [type, count] : row.types)
      types +=
          fmt::format("{}{} {}", types.empty() ? "" : ", ", count, surfaceName(type));
    table.push_back({viewsText(i),
                     fmt::format("{}", row.count),
                     fmt::format("{:.3f}", 1e3 * median(row.height)),
                     fmt::format("{:.3f}", median(row.normal) * 180.0 / kPi),
                     types});
  }
  return formatTable(table) +
         fmt::format(
             "{} patches from {} frames; a single view's sigma of the height is "
             "{:.3f} mm (median)\n",
             map.patches().size(),
             map.frames(),
             1e3 * median(std::move(single_sigmas_m)));
}

} // namespace holdfast::app
