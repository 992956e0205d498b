/// \file Independent pieces of work on several threads.
#pragma once

#include <functional>

namespace holdfast {

/// Told (done, total) now and then, from one thread at a time.
using Progress = std::function<void(int, int)>;

/// Calls work(i) for every i in [0, count), each once, in any order, and returns when
/// all are done. Results that depend only on i do not depend on the number of threads.
/// \param threads 0: all cores. \throw what the first failed call threw; the calls not
/// yet begun are then left out.
void forEachIndex(int count,
                  int threads,
                  const std::function<void(int)>& work,
                  const Progress& progress = {});

} // namespace holdfast
