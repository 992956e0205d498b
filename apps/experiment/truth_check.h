/// \file Patches of a simulated frame against the surface that was there.
#pragma once

#include <holdfast/patch/patch.h>
#include <holdfast/sensor/sensor.h>
#include <holdfast/simulation/simulator.h>

#include <vector>

namespace holdfast::app {

/// One patch against the surface that was there.
struct PatchTruth {
  bool over_edge = false; ///< leavesTrueSurface()
  std::vector<int> covered; ///< samples of the smooth surface that lie on it
};

/// True when in more than a twentieth of the pixels that see the patch, the point that
/// was really there is more than four sigmas of a measured point away from it, along
/// its normal. \param camera whose pixels the image has.
bool leavesTrueSurface(const RangeImage& image,
                       const Camera& camera,
                       const Patch& patch);

/// Patches against the smooth parts of the true surface, too: it is smooth at a pixel,
/// of which every eighth is looked at, when the noise-free points of the neighbourhood
/// there fill its disc by nine tenths and leave a patch by less than half a sigma (root
/// mean square).
class TruthCheck {
public:
  /// Refers to the image, which must outlive it.
  TruthCheck(const RangeImage& image, const Sensor& sensor, double radius_m);

  PatchTruth check(const Patch& patch) const;

  /// How many samples of the smooth surface there are.
  int smoothSamples() const
  {
    return smooth_samples_;
  }

private:
  const RangeImage& image_;
  Camera camera_;
  int smooth_samples_ = 0;
  std::vector<int> sample_of_; ///< by pixel; -1: none
};

} // namespace holdfast::app
