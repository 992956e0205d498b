#include "patch_view.h"

#include "render/render_colors.h"
#include "summary.h"

#include <fmt/core.h>

#include <cmath>
#include <utility>

namespace holdfast::app {
namespace {

/// Ends of the scale of colours, rms angle of the normal, degrees.
constexpr double kSurest = 0.1;
constexpr double kLeastSure = 10.0;

ShownPatch
toShown(const ExtractedPatch& patch)
{
  const FitResult& fit = patch.fit;
  const double sigma_deg = normalSigmaDegrees(fit);
  const Eigen::Vector2d kappa = fit.patch.principalCurvatures();
  ShownPatch shown;
  shown.patch = fit.patch;
  shown.centre_covariance = fit.covariance.bottomRightCorner<3, 3>();
  shown.color = viridis(std::log(sigma_deg / kSurest) / std::log(kLeastSure / kSurest));
  shown.caption = fmt::format("{}, {} points, chi2/dof {:.2f}\n"
                              "curvatures {:.2f} and {:.2f} 1/m\n"
                              "sigma: normal {:.2f} deg, centre {:.2f} mm",
                              spacedName(fit.patch.type.surface),
                              fit.points,
                              chi2PerDof(fit),
                              kappa.x(),
                              kappa.y(),
                              sigma_deg,
                              centreSigmaMillimetres(fit));
  shown.seed = patch.seed_index.value_or(0);
  return shown;
}

} // namespace

PatchView::PatchView()
: window_(
      openViewer(fmt::format("dark: normal within {:g} deg, yellow: within {:g} deg",
                             kSurest,
                             kLeastSure)))
{}

void
PatchView::put(const RangeFrame::ConstPtr& frame,
               const std::vector<ExtractedPatch>& patches)
{
  std::vector<ShownPatch> shown;
  for (const ExtractedPatch& patch : patches)
    shown.push_back(toShown(patch));
  const std::lock_guard<std::mutex> lock(mutex_);
  frame_ = frame;
  patches_ = std::move(shown);
}

bool
PatchView::update()
{
  std::unique_lock<std::mutex> lock(mutex_);
  const RangeFrame::ConstPtr frame = std::exchange(frame_, nullptr);
  const std::vector<ShownPatch> patches = std::move(patches_);
  lock.unlock();
  if (frame)
    window_->show(*frame, patches);
  return window_->update();
}

} // namespace holdfast::app
