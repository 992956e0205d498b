#include "thread_memory.h"

#include <new>

#include <pthread.h>

namespace holdfast {

void
deleteOwned(void* last)
{
  for (auto* owned = static_cast<ThreadOwned*>(last); owned != nullptr;) {
    const std::unique_ptr<ThreadOwned> deleted(owned);
    owned = owned->before_;
  }
}

namespace {

pthread_key_t
keyOfOwned()
{
  static const pthread_key_t key = [] {
    pthread_key_t made{};
    if (pthread_key_create(&made, deleteOwned) != 0)
      throw std::bad_alloc();
    return made;
  }();
  return key;
}

} // namespace

void
giveToThread(std::unique_ptr<ThreadOwned> owned)
{
  const pthread_key_t key = keyOfOwned();
  owned->before_ = static_cast<ThreadOwned*>(pthread_getspecific(key));
  if (pthread_setspecific(key, owned.get()) != 0)
    throw std::bad_alloc();
  owned.release();
}

} // namespace holdfast
