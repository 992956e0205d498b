#include "parallel_for.h"

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <new>
#include <system_error>
#include <thread>
#include <vector>

namespace holdfast {
namespace {

/// What the threads share.
class Work {
public:
  Work(int count, const std::function<void(int, int)>& work, const Progress& progress)
  : count_(count)
  , every_(std::max(1, count / kReports))
  , work_(work)
  , progress_(progress)
  {}

  void run(int thread)
  {
    for (int i = next_++; i < count_; i = next_++) {
      try {
        work_(i, thread);
        report();
      }
      catch (...) {
        fail(std::current_exception());
      }
    }
  }

  void rethrow() const
  {
    if (error_)
      std::rethrow_exception(error_);
  }

private:
  static constexpr int kReports = 200; // more than anyone can see

  void report()
  {
    if (!progress_)
      return;
    const std::lock_guard<std::mutex> lock(mutex_);
    ++done_;
    if (done_ % every_ == 0 || done_ == count_)
      progress_(done_, count_);
  }

  void fail(const std::exception_ptr& error)
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!error_)
      error_ = error;
    next_ = count_;
  }

  const int count_;
  const int every_;
  const std::function<void(int, int)>& work_;
  const Progress& progress_;
  std::atomic<int> next_{0};
  std::mutex mutex_;
  int done_ = 0;
  std::exception_ptr error_;
};

/// Threads that are joined whatever happens.
class Helpers {
public:
  Helpers() = default;
  Helpers(const Helpers&) = delete;
  Helpers& operator=(const Helpers&) = delete;
  ~Helpers()
  {
    for (std::thread& thread : threads_)
      thread.join();
  }

  /// Starts as many as the system gives, up to `count`, as threads 1, 2, ...
  void start(int count, Work& work)
  {
    // No more to be had, for want of threads or of memory: fewer do the work.
    try {
      threads_.reserve(static_cast<std::size_t>(std::max(count, 0)));
      for (int i = 1; i <= count; ++i)
        threads_.emplace_back([&work, i] { work.run(i); });
    }
    catch (const std::system_error&) {
    }
    catch (const std::bad_alloc&) {
    }
  }

private:
  std::vector<std::thread> threads_;
};

} // namespace

int
threadCount(int requested)
{
  return requested > 0 ?
             requested :
             static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
}

void
parallelFor(int count,
            int threads,
            const std::function<void(int, int)>& work,
            const Progress& progress)
{
  Work shared(count, work, progress);
  {
    Helpers helpers;
    helpers.start(std::min(threadCount(threads), count) - 1, shared);
    shared.run(0);
  }
  shared.rethrow();
}

} // namespace holdfast
