#include <algorithm>
#include <climits>
#include <utility>

#include <linux/futex.h>
#include <sys/syscall.h>
#include <sys/timerfd.h>
#include <time.h>
#include <unistd.h>

#include "schedulers/clock.hpp"
#include "shm/base/system_call.hpp"
#include "shm/base/unique_fd.hpp"

namespace plchost {

namespace {

/// The task's thread sleeps in read(), one system call per cycle. An interrupt makes the timer go off again
/// and again before it raises the flag: whoever sees the flag knows that the timer is not touched any more,
/// and who read too early is woken once more.
class TimerFd final : public PeriodicTimer {
 public:
  explicit TimerFd(UniqueFd fd) noexcept : fd_(std::move(fd)) {}

  void start(TimePoint first, Duration period) noexcept override {
    // Zero would disarm it.
    arm(std::max(first.time_since_epoch(), Duration(1)), period, TFD_TIMER_ABSTIME);
  }

  std::uint64_t wait() noexcept override {
    for (;;) {
      if (interrupted_.load(std::memory_order_relaxed) &&
          interrupted_.exchange(false, std::memory_order_acquire)) {
        return 0;
      }
      std::uint64_t count = 0;
      // Early only for the reasons above or for a signal: the flag tells.
      const bool went_off = ::read(fd_.get(), &count, sizeof count) == ssize_t{sizeof count};
      if (went_off && !interrupted_.load(std::memory_order_relaxed)) return count;
    }
  }

  void interrupt() noexcept override {
    constexpr Duration kNow(1);
    constexpr Duration kUntilSeen = std::chrono::microseconds(100);
    arm(kNow, kUntilSeen, 0);
    interrupted_.store(true, std::memory_order_release);
  }

 private:
  // Cannot fail: the descriptor is ours and the values are in range.
  void arm(Duration first, Duration period, int flags) noexcept {
    const itimerspec value{.it_interval = to_timespec(period), .it_value = to_timespec(first)};
    ::timerfd_settime(fd_.get(), flags, &value, nullptr);
  }

  UniqueFd fd_;
  std::atomic<bool> interrupted_{false};
};

inline void relax_processor() noexcept {
#if defined(__x86_64__) || defined(__i386__)
  __builtin_ia32_pause();
#elif defined(__aarch64__)
  asm volatile("yield");
#endif
}

}  // namespace

Duration Clock::thread_time() const noexcept {
  timespec used{};
  ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &used);  // cannot fail for the thread itself
  return std::chrono::seconds(used.tv_sec) + Duration(used.tv_nsec);
}

void LinuxClock::wait(const std::atomic<std::uint32_t>& word, std::uint32_t expected,
                      TimePoint deadline) noexcept {
  const timespec until = to_timespec(deadline);
  ::syscall(SYS_futex, &word, FUTEX_WAIT_BITSET_PRIVATE, expected, deadline == kNoDeadline ? nullptr : &until,
            nullptr, FUTEX_BITSET_MATCH_ANY);
}

void LinuxClock::wake(const std::atomic<std::uint32_t>& word) noexcept {
  ::syscall(SYS_futex, &word, FUTEX_WAKE_PRIVATE, INT_MAX, nullptr, nullptr, 0);
}

void LinuxClock::spin_until(TimePoint deadline) noexcept {
  while (now() < deadline) relax_processor();
}

Result<std::unique_ptr<PeriodicTimer>> LinuxClock::make_periodic_timer() {
  const auto fd = check_errno(::timerfd_create(CLOCK_MONOTONIC, TFD_CLOEXEC), "timerfd_create");
  if (!fd) return std::unexpected(fd.error());
  return std::make_unique<TimerFd>(UniqueFd(*fd));
}

}  // namespace plchost
