#include "schedulers/clock/timer_pair.hpp"

#include <algorithm>
#include <utility>

#include <sys/timerfd.h>
#include <unistd.h>

#include "shm/base/futex.hpp"

namespace plchost {

TimerPair::TimerPair(UniqueFd first, UniqueFd second) noexcept
    : halves_{Half{.fd = std::move(first), .due = {}}, Half{.fd = std::move(second), .due = {}}} {}

void TimerPair::start(TimePoint first, Duration period) noexcept {
  period_ = 2 * period;
  for (Half& half : halves_) {
    half.due = first;
    // Zero would disarm it.
    half.arm(std::max(first.time_since_epoch(), Duration(1)), period_, TFD_TIMER_ABSTIME);
    first += period;
  }
}

std::uint64_t TimerPair::wait() noexcept {
  for (;;) {
    if (take_interrupt()) return 0;
    const std::uint64_t count = went_off();
    // Early only because of an interrupt or a signal.
    if (count != 0 && interrupt_.load(std::memory_order_relaxed) == kNone) return count;
  }
}

// Asked before it is armed: a thread that arms the timers after us and before it sleeps sees that it is
// asked.
void TimerPair::interrupt() noexcept {
  constexpr Duration kNow(1);
  constexpr Duration kUntilSeen = std::chrono::microseconds(100);
  interrupt_.store(kAsked);
  for (const Half& half : halves_) half.arm(kNow, kUntilSeen, 0);
  interrupt_.store(kDone);
  futex_wake(&interrupt_);
}

bool TimerPair::take_interrupt() noexcept {
  for (;;) {
    std::uint32_t state = interrupt_.load();
    if (state == kNone) return false;
    if (state == kAsked) futex_wait(&interrupt_, kAsked);
    if (state == kDone && interrupt_.compare_exchange_strong(state, kNone)) return true;
  }
}

// A thread that was busy for longer than a period finds that both went off. One that is due just now may be
// about to, and is left for the next call: a read of it would sleep.
std::uint64_t TimerPair::went_off() noexcept {
  constexpr Duration kSurely = std::chrono::microseconds(20);
  const std::uint64_t count = next().read(period_);
  if (count == 0 || next().due > MonotonicClock::now() - kSurely) return count;
  return count + next().read(period_);
}

// Cannot fail: the descriptor is ours and the values are in range.
void TimerPair::Half::arm(Duration first, Duration period, int flags) const noexcept {
  const itimerspec value{.it_interval = to_timespec(period), .it_value = to_timespec(first)};
  ::timerfd_settime(fd.get(), flags, &value, nullptr);
}

std::uint64_t TimerPair::Half::read(Duration period) noexcept {
  std::uint64_t count = 0;
  if (::read(fd.get(), &count, sizeof count) != ssize_t{sizeof count}) return 0;
  due += static_cast<Duration::rep>(count) * period;
  return count;
}

}  // namespace plchost
