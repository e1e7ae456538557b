#include "api/cli/interrupt.hpp"

#include <algorithm>
#include <atomic>
#include <csignal>
#include <ctime>

namespace plchost {

namespace {

std::atomic<bool>& flag() noexcept {
  static std::atomic<bool> has_come{false};
  return has_come;
}

}  // namespace

void catch_interrupts() {
  struct sigaction action{};
  action.sa_handler = [](int /*signal*/) { flag().store(true); };
  ::sigaction(SIGINT, &action, nullptr);
  ::sigaction(SIGTERM, &action, nullptr);
}

bool interrupted() noexcept {
  return flag().load();
}

void sleep_until_interrupted(TimePoint end) {
  for (TimePoint now = MonotonicClock::now(); now < end && !interrupted(); now = MonotonicClock::now()) {
    const timespec slice = to_timespec(std::min(end - now, kInterruptLook));
    ::nanosleep(&slice, nullptr);
  }
}

}  // namespace plchost
