#include <climits>

#include <linux/futex.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

#include "tests/bench/cyclic_loop.hpp"

namespace plchost::bench {

BareHop::~BareHop() {
  (void)stop();
}

Result<void> BareHop::start(CycleLog& log) {
  stopping_.store(false);
  constexpr ThreadPriority kAbove{.fifo = kPriority.fifo + 1};
  PLCHOST_TRY_ASSIGN(thread_, Thread::start("floor", kPriority, [this, &log] { run(log); }));
  PLCHOST_TRY_ASSIGN(tick_, Thread::start("floor-tick", kAbove, [this] { tick(); }));
  return {};
}

Result<void> BareHop::stop() {
  stopping_.store(true);
  tick_.join();
  open();
  thread_.join();
  return {};
}

void BareHop::open() noexcept {
  word_.fetch_add(1, std::memory_order_release);
  ::syscall(SYS_futex, &word_, FUTEX_WAKE_PRIVATE, INT_MAX, nullptr, nullptr, 0);
}

void BareHop::tick() noexcept {
  TimePoint release = MonotonicClock::now() + TaskSet::kStartLead;
  while (!stopping_.load(std::memory_order_relaxed)) {
    const timespec until = to_timespec(release);
    ::clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, nullptr);
    release_ns_.store(release.time_since_epoch().count(), std::memory_order_relaxed);
    open();
    const TimePoint now = MonotonicClock::now();
    do release += period_;
    while (release <= now);
  }
}

void BareHop::run(CycleLog& log) noexcept {
  for (std::uint32_t seen = word_.load();;) {
    while (word_.load(std::memory_order_acquire) == seen)
      ::syscall(SYS_futex, &word_, FUTEX_WAIT_PRIVATE, seen, nullptr, nullptr, 0);
    const TimePoint start = MonotonicClock::now();
    if (stopping_.load()) return;
    seen = word_.load(std::memory_order_relaxed);
    log.add({TimePoint(Duration(release_ns_.load(std::memory_order_relaxed))), start});
  }
}

}  // namespace plchost::bench
