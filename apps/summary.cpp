#include "summary.h"

#include "console.h"

#include <holdfast/geometry/constants.h>

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <functional>

namespace holdfast::app {
namespace {

using Measure = std::function<double(const FitResult&)>;
using Fits = std::vector<const FitResult*>;

double
median(const Fits& fits, const Measure& measure)
{
  std::vector<double> values;
  for (const FitResult* fit : fits)
    values.push_back(measure(*fit));
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// The principal curvature of larger magnitude.
double
curvature(const FitResult& fit)
{
  const Eigen::Vector2d kappa = fit.patch.principalCurvatures();
  return std::abs(kappa.x()) > std::abs(kappa.y()) ? kappa.x() : kappa.y();
}

std::vector<std::string>
tableRow(SurfaceType surface, const Fits& fits)
{
  const auto value = [&fits](const char* format, const Measure& measure) {
    return formatNumber(format, median(fits, measure));
  };
  const bool flat = surface == SurfaceType::Plane;
  return {std::string(surfaceName(surface)),
          std::to_string(fits.size()),
          value("%.0f", [](const FitResult& fit) { return fit.points; }),
          value("%.2f", chi2PerDof),
          value("%.2f", normalSigmaDegrees),
          value("%.2f", centreSigmaMillimetres),
          flat ? "-" : value("%.1f", curvature)};
}

std::string
heading(const PatchReport& report)
{
  const auto patches = static_cast<double>(report.result.patches.size());
  return fmt::format("{}: {:.0f} {}, sensor {}, loaded in {:.0f} ms, fitted in {:.1f} "
                     "ms ({:.0f} patches/s)\n",
                     report.cloud,
                     patches,
                     patches == 1.0 ? "patch" : "patches",
                     report.result.sensor.name,
                     report.load_ms,
                     report.fit_ms,
                     1e3 * patches / std::max(report.fit_ms, 1e-6));
}

} // namespace

double
normalSigmaDegrees(const FitResult& fit)
{
  return normalSigma(fit) * 180.0 / kPi;
}

double
centreSigmaMillimetres(const FitResult& fit)
{
  return 1e3 * centreSigma(fit);
}

std::string
rejectedText(const ExtractionResult& result)
{
  std::string text;
  const auto append = [&text](std::string_view reason, int count) {
    text += fmt::format("{}{} {}", text.empty() ? "" : ", ", reason, count);
  };
  for (const auto& [status, count] : result.rejected)
    append(statusName(status), count);
  for (const auto& [verdict, count] : result.turned_down)
    append(verdictName(verdict), count);
  return text;
}

std::string
summaryTable(const PatchReport& report)
{
  std::map<SurfaceType, Fits> by_surface;
  for (const ExtractedPatch& patch : report.result.patches)
    by_surface[patch.fit.patch.type.surface].push_back(&patch.fit);
  std::vector<std::vector<std::string>> rows{{"surface (medians)",
                                              "count",
                                              "points",
                                              "chi2/dof",
                                              "sigma normal deg",
                                              "sigma centre mm",
                                              "curvature 1/m"}};
  for (const auto& [surface, fits] : by_surface)
    rows.push_back(tableRow(surface, fits));
  const std::string rejected = rejectedText(report.result);
  const int second = report.result.second_attempts;
  std::string text = heading(report) + formatTable(rows);
  if (!rejected.empty())
    text += fmt::format("rejected: {}\n", rejected);
  if (second != 0)
    text +=
        fmt::format("of several surfaces, fitted to the seed's alone: {}\n", second);
  return text;
}

} // namespace holdfast::app
