#include "api/server/posts/core_share.hpp"

#include <ctime>
#include <thread>

namespace plchost {

namespace {

Duration used_by_this_thread() noexcept {
  timespec time{};
  ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return std::chrono::seconds(time.tv_sec) + std::chrono::nanoseconds(time.tv_nsec);
}

}  // namespace

void CoreShare::rest_if_due() noexcept {
  const TimePoint now = MonotonicClock::now();
  if (now - window_begin_ < kWindow) return;
  const Duration used = used_by_this_thread();
  // After a pause it is a fresh start: what it had not then is not saved up.
  if (now - window_begin_ < 2 * kWindow) {
    const Duration rest = rest_after(now - window_begin_, used - used_before_);
    if (rest > Duration::zero()) std::this_thread::sleep_for(rest);
  }
  window_begin_ = MonotonicClock::now();
  used_before_ = used;
}

}  // namespace plchost
