#include <array>
#include <climits>
#include <memory>
#include <utility>

#include <linux/futex.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <sys/timerfd.h>
#include <time.h>
#include <unistd.h>

#include "schedulers/clock/clock.hpp"
#include "schedulers/clock/timer_pair.hpp"
#include "shm/base/system_call.hpp"
#include "shm/base/unique_fd.hpp"

namespace plchost {

namespace {

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
  std::array<UniqueFd, 2> fds;
  for (UniqueFd& fd : fds) {
    PLCHOST_TRY_ASSIGN(const auto made,
                       check_errno(::timerfd_create(CLOCK_MONOTONIC, TFD_CLOEXEC), "cannot create a timer"));
    fd = UniqueFd(made);
  }
  return std::make_unique<TimerPair>(std::move(fds[0]), std::move(fds[1]));
}

Result<Thread> start_clock_thread(Clock& clock, const std::string& name, ThreadPriority priority,
                                  std::function<void()> body) {
  PLCHOST_TRY_ASSIGN(auto signals, AlternateStack::make());
  auto stack = std::make_shared<AlternateStack>(std::move(signals));
  clock.thread_begins();
  auto thread = Thread::start(name, priority, [&clock, stack = std::move(stack), body = std::move(body)] {
    const AlternateStack::Use use(*stack);
    // SCHED_FIFO has none; the others would wake up to 50 us late.
    ::prctl(PR_SET_TIMERSLACK, 1UL);
    body();
    clock.thread_ends();
  });
  if (!thread) clock.thread_ends();
  return thread;
}

}  // namespace plchost
