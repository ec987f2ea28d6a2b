#pragma once

/// @file
/// Counts what a thread allocates: operator new and Eigen both end in malloc. To be included by one source of a
/// program. The sanitizers bring their own: with them JACKAL_AIC_COUNTS is 0.

#include <cstddef>

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define JACKAL_AIC_COUNTS 0
#else
#define JACKAL_AIC_COUNTS 1
#endif

namespace {
thread_local bool counting = false;  // whether it counts
thread_local int allocations = 0;    // so far
}  // namespace

#if JACKAL_AIC_COUNTS
extern "C" void* __libc_malloc(std::size_t size);  // NOLINT(bugprone-reserved-identifier): glibc's name
extern "C" void* malloc(std::size_t size) noexcept {
  if (counting) ++allocations;
  return __libc_malloc(size);
}
#endif
