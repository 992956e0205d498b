#include "summary.h"

#include "console.h"

#include <holdfast/geometry/constants.h>

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
  return report.cloud + ": " + formatNumber("%.0f", patches) +
         (patches == 1.0 ? " patch" : " patches") + ", sensor " +
         report.result.sensor.name + ", loaded in " +
         formatNumber("%.0f", report.load_ms) + " ms, fitted in " +
         formatNumber("%.1f", report.fit_ms) + " ms (" +
         formatNumber("%.0f", 1e3 * patches / std::max(report.fit_ms, 1e-6)) +
         " patches/s)\n";
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
    text +=
        (text.empty() ? "" : ", ") + std::string(reason) + ' ' + std::to_string(count);
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
  return heading(report) + formatTable(rows) +
         (rejected.empty() ? "" : "rejected: " + rejected + "\n") +
         (second == 0 ? "" :
                        "of several surfaces, fitted to the seed's alone: " +
                            std::to_string(second) + "\n");
}

} // namespace holdfast::app
