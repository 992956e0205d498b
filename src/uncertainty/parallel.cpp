#include <holdfast/uncertainty/parallel.h>

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace holdfast {
namespace {

// What the threads share.
class Work {
public:
  Work(int count, const std::function<void(int)>& work, const Progress& progress)
  : count_(count), work_(work), progress_(progress)
  {}

  void run()
  {
    for (int i = next_++; i < count_; i = next_++) {
      try {
        work_(i);
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
  void report()
  {
    if (!progress_)
      return;
    const std::lock_guard<std::mutex> lock(mutex_);
    progress_(++done_, count_);
  }

  void fail(const std::exception_ptr& error)
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!error_)
      error_ = error;
    next_ = count_;
  }

  const int count_;
  const std::function<void(int)>& work_;
  const Progress& progress_;
  std::atomic<int> next_{0};
  std::mutex mutex_;
  int done_ = 0;
  std::exception_ptr error_;
};

} // namespace

void
forEachIndex(int count,
             int threads,
             const std::function<void(int)>& work,
             const Progress& progress)
{
  if (threads <= 0)
    threads = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  Work shared(count, work, progress);
  std::vector<std::thread> others;
  for (int i = 1; i < std::min(threads, count); ++i)
    others.emplace_back([&shared] { shared.run(); });
  shared.run();
  for (std::thread& thread : others)
    thread.join();
  shared.rethrow();
}

} // namespace holdfast
