/// \file What a picture shows: clouds and patches.
#pragma once

#include "patch_support.h"
#include "result_input.h"
#include "view.h"

#include <holdfast/patch/patch.h>

#include <cstdint>

namespace holdfast::app {

/// Draws points as discs just large enough to touch their neighbours.
void drawPoints(Canvas& canvas,
                const View& view,
                const Frame& frame,
                const PicturePoints& points);

/// Of a patch drawn as glass.
enum class PatchEdge : std::uint8_t { Line, None };

/// Draws a patch as tinted glass, with an outline or without. It stands off its surface
/// by a fraction of its size, so that the noise of the points it is fitted to does not
/// cover it but other things do. Where no points support it there is the outline alone.
void drawPatch(Canvas& canvas,
               const View& view,
               const Patch& patch,
               const SupportedCells& support,
               const Rgb& color,
               PatchEdge edge = PatchEdge::Line);

/// Draws a patch as a solid sheet with lines of constant x and y, and its axes: x red,
/// y green, z blue.
void drawSolidPatch(Canvas& canvas,
                    const View& view,
                    const Patch& patch,
                    const Rgb& color);

} // namespace holdfast::app
