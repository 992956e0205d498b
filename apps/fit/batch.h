/// \file Many clouds, of which each leaves its results or a record of why there are
/// none.
#pragma once

#include "fit_settings.h"

#include <holdfast/io/patch_io.h>

#include <functional>
#include <string>

namespace holdfast::app {

/// Calls fit(PATH) for the clouds of settings.shard of settings.manifest, as far as
/// --resume does not leave them. Of each there is one of two things afterwards in the
/// output folder, complete: its results, or, when fit() threw, NAME.failed.json. A
/// process that is killed leaves finished clouds as they are and the one that it was at
/// without either.
/// \return the exit code: 0, or 2 when there are clouds that failed, now or before.
/// \throw std::runtime_error "PATH: cause" when the manifest cannot be read, something
/// cannot be written, or the system is short of what is no cloud's fault.
int runBatch(const FitSettings& settings,
             const std::function<PatchReport(const std::string&)>& fit);

} // namespace holdfast::app
