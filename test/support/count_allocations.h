/// \file Counts every allocation of a program, its libraries' included. For one source
/// file of a program: it defines malloc().
#pragma once

// Declares posix_memalign() in a way that only a definition after it may differ from.
#include <Eigen/Core>

#include <atomic>
#include <cerrno>
#include <cstddef>
#include <cstdlib>

// A sanitizer puts its own functions before the C library's.
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define HOLDFAST_COUNTS_ALLOCATIONS 1
#endif

namespace holdfast::test {

/// So far, of all threads.
inline std::atomic<long> allocations{0};

} // namespace holdfast::test

#ifdef HOLDFAST_COUNTS_ALLOCATIONS

extern "C" {

void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t count, std::size_t size);
void* __libc_realloc(void* pointer, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);

// These stand before the C library's of the same name; `operator new` ends in them.
void*
malloc(std::size_t size)
{
  ++holdfast::test::allocations;
  return __libc_malloc(size);
}

void*
calloc(std::size_t count, std::size_t size)
{
  ++holdfast::test::allocations;
  return __libc_calloc(count, size);
}

void*
realloc(void* pointer, std::size_t size)
{
  ++holdfast::test::allocations;
  return __libc_realloc(pointer, size);
}

void*
aligned_alloc(std::size_t alignment, std::size_t size)
{
  ++holdfast::test::allocations;
  return __libc_memalign(alignment, size);
}

int
posix_memalign(void** pointer, std::size_t alignment, std::size_t size)
{
  ++holdfast::test::allocations;
  *pointer = __libc_memalign(alignment, size);
  return *pointer ? 0 : ENOMEM;
}
}

#endif
