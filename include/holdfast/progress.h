/// \file How long work tells how far it is.
#pragma once

#include <functional>

namespace holdfast {

/// Called with (done, total) now and then, from one thread at a time; `done` never
/// falls, and the last call has done == total.
using Progress = std::function<void(int done, int total)>;

} // namespace holdfast
