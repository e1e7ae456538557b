#pragma once

#include <climits>
#include <cstdint>

#include "shm/base/time.hpp"

namespace plchost {

enum class FutexResult : std::uint8_t {
  woken,      ///< by a wake, or spuriously: look again
  changed,    ///< the word did not hold the expected value
  timed_out,  ///< the deadline has passed
};

inline constexpr TimePoint kNoDeadline = TimePoint::max();

/// Sleeps while the 32-bit word at `word` equals `expected`, at most until `deadline` (absolute,
/// CLOCK_MONOTONIC). Works across processes that map the same memory. Real-time: no allocation, no lock.
FutexResult futex_wait(const void* word, std::uint32_t expected, TimePoint deadline = kNoDeadline) noexcept;

/// Wakes up to `count` threads that sleep on `word`, highest priority first. How many it were. Any context.
int futex_wake(const void* word, int count = INT_MAX) noexcept;

}  // namespace plchost
