#pragma once

#include <chrono>
#include <cstdint>

#include <time.h>

namespace plchost {

/// CLOCK_MONOTONIC, in nanoseconds: the one clock that all processes of a host share, and the only one
/// that releases, latencies and timeouts are computed with.
struct MonotonicClock {
  using duration = std::chrono::nanoseconds;
  using rep = duration::rep;
  using period = duration::period;
  using time_point = std::chrono::time_point<MonotonicClock>;
  static constexpr bool is_steady = true;  // NOLINT(readability-identifier-naming): <chrono>'s name

  /// Real-time: no system call (vDSO).
  [[nodiscard]] static time_point now() noexcept {
    timespec value{};
    ::clock_gettime(CLOCK_MONOTONIC, &value);
    return time_point(std::chrono::seconds(value.tv_sec) + std::chrono::nanoseconds(value.tv_nsec));
  }
};

using Duration = MonotonicClock::duration;
using TimePoint = MonotonicClock::time_point;

/// CLOCK_REALTIME, only to tell people and other machines when something was: nanoseconds since 1970.
[[nodiscard]] inline std::int64_t unix_time_ns() noexcept {
  timespec value{};
  ::clock_gettime(CLOCK_REALTIME, &value);
  return Duration(std::chrono::seconds(value.tv_sec) + std::chrono::nanoseconds(value.tv_nsec)).count();
}

/// CLOCK_BOOTTIME, nanoseconds: as CLOCK_MONOTONIC, but it also counts while the machine is suspended. Time
/// limits that come from other machines are told by it.
[[nodiscard]] inline std::int64_t boot_time_ns() noexcept {
  timespec value{};
  ::clock_gettime(CLOCK_BOOTTIME, &value);
  return Duration(std::chrono::seconds(value.tv_sec) + std::chrono::nanoseconds(value.tv_nsec)).count();
}

[[nodiscard]] constexpr timespec to_timespec(Duration since_epoch) noexcept {
  constexpr std::int64_t kNanosecondsPerSecond = 1'000'000'000;
  return {.tv_sec = since_epoch.count() / kNanosecondsPerSecond,
          .tv_nsec = since_epoch.count() % kNanosecondsPerSecond};
}
[[nodiscard]] constexpr timespec to_timespec(TimePoint when) noexcept {
  return to_timespec(when.time_since_epoch());
}

}  // namespace plchost
