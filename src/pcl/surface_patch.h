/// \file The pixels of one surface within a metric radius of a seed, along the surface.
#pragma once

#include "pixel_disc.h"
#include "reference_surface.h"

#include <vector>

namespace holdfast {

/// How much of what is around a seed counts as its surface.
enum class Strictness {
  Usual,
  /// For a second attempt: the surface is what the inner half of the radius shows, and
  /// what leaves it by more than the noise is none of it.
  Strict
};

struct SurfacePatchSettings {
  double radius_m = 0.0;
  double jump_sigmas = 0.0; ///< SamplerOptions
  Strictness strictness = Strictness::Usual;
};

/// Working memory.
struct SurfacePatchScratch {
  RunMemory runs;
  std::vector<int> pixels;
  std::vector<int> members;
  std::vector<float> window;
  std::vector<PixelRange> chords; ///< of the rows of the window
};

struct SurfaceSeed {
  int pixel; ///< a valid one
  JumpLimit limit; ///< at the seed, for the pixels nearest to it
  double sigma_z; ///< of a point at the seed, m
};

/// Replaces `indices` by the pixels whose rays meet the seed's surface within the
/// radius and whose points continue it, connected to the seed; ascending.
///
/// The surface is found from the pixels nearest the seed, as a plane, then from those
/// within the radius, as a quadric. Points continue it whose depths leave it together
/// with their neighbours', within the noise and a slope of 45 degrees against it.
void surfacePatch(const PixelGrid& grid,
                  const SurfaceSeed& seed,
                  const SurfacePatchSettings& settings,
                  SurfacePatchScratch& scratch,
                  std::vector<int>& indices);

/// The same among points that are no image, without their connection.
/// \param seed in the camera frame, in front of it, m.
/// \param candidates those within a ball about it, somewhat larger than the radius, in
///        the camera frame, m.
/// \param belongs one for each candidate.
void surfaceMembers(const Eigen::Vector3d& seed,
                    const std::vector<Eigen::Vector3d>& candidates,
                    double sigma_z,
                    const SurfacePatchSettings& settings,
                    SurfacePatchScratch& scratch,
                    std::vector<bool>& belongs);

} // namespace holdfast
