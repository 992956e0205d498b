/// \file Working memory that a thread keeps from call to call.
#pragma once

#include <memory>

namespace holdfast {

/// What a thread deletes at its end.
class ThreadOwned {
public:
  virtual ~ThreadOwned() = default;

private:
  friend void giveToThread(std::unique_ptr<ThreadOwned> owned);
  friend void deleteOwned(void* last);
  ThreadOwned* before_ = nullptr;
};

/// \throw std::bad_alloc
void giveToThread(std::unique_ptr<ThreadOwned> owned);

/// The calling thread's own T, made by its first call and deleted at its end; one for
/// each Tag.
///
/// In place of a thread_local T: where there is no memory left to note its destructor,
/// glibc ends the program ("failed to register TLS destructor").
/// \throw std::bad_alloc
template <typename T, typename Tag>
T&
threadMemory()
{
  struct Owned : ThreadOwned {
    T value;
  };
  thread_local Owned* mine = nullptr; // nothing to be destroyed
  if (mine == nullptr) {
    auto made = std::make_unique<Owned>();
    Owned* const raw = made.get();
    giveToThread(std::move(made));
    mine = raw;
  }
  return mine->value;
}

} // namespace holdfast
