/// \file Independent pieces of work on several threads: the one loop of the project.
#pragma once

#include <holdfast/progress.h>

#include <functional>

namespace holdfast {

/// How many threads a request means; 0: one per core.
int threadCount(int requested);

/// Calls work(item, thread) for every item in [0, count), each once, begun in their
/// order, and returns when all are done. `thread`, below threadCount(threads), tells
/// the threads apart. Results that depend on the item alone do not depend on the number
/// of threads.
///
/// Where the system has no more threads to give, those there are do the work.
/// \throw what the first failed call threw; the items not yet begun are then left out.
void parallelFor(int count,
                 int threads,
                 const std::function<void(int item, int thread)>& work,
                 const Progress& progress = {});

} // namespace holdfast
