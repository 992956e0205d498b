// Memory of a thread: its own, the same from call to call, gone with the thread.
#include "parallel/thread_memory.h"

#include <gtest/gtest.h>

#include <atomic>
#include <thread>
#include <vector>

namespace holdfast { namespace {

std::atomic<int> living{0};

struct Counted {
  Counted()
  {
    ++living;
  }
  Counted(const Counted&) = delete;
  ~Counted()
  {
    --living;
  }
  int value = 0;
};

Counted&
one()
{
  return threadMemory<Counted, struct One>();
}

Counted&
other()
{
  return threadMemory<Counted, struct Other>();
}

TEST(ThreadMemory, IsOfOneThreadAndTagAndEndsWithTheThread)
{
  one().value = 7;
  EXPECT_EQ(&one(), &one());
  EXPECT_NE(&one(), &other());
  EXPECT_EQ(living, 2);
  constexpr int kThreads = 20;
  std::vector<std::thread> threads;
  std::atomic<int> fresh{0};
  for (int i = 0; i < kThreads; ++i)
    threads.emplace_back([&fresh, i] {
      fresh += one().value == 0 && other().value == 0 ? 1 : 0;
      one().value = i;
      fresh += one().value == i ? 1 : 0;
    });
  for (std::thread& thread : threads)
    thread.join();
  EXPECT_EQ(fresh, 2 * kThreads);
  EXPECT_EQ(living, 2); // those of this thread
  EXPECT_EQ(one().value, 7);
}

}} // namespace holdfast
