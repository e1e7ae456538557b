#include <chrono>

#include <time.h>

#include "schedulers/faults/processor_times.hpp"

namespace plchost {

namespace {

Duration used(clockid_t clock) noexcept {
  timespec time{};
  if (::clock_gettime(clock, &time) != 0) return Duration::zero();
  return std::chrono::seconds(time.tv_sec) + Duration(time.tv_nsec);
}

// The kernel's number for the CPU clock of a thread of this process.
clockid_t thread_clock(pid_t thread) noexcept {
  constexpr unsigned kPerThread = 4;
  constexpr unsigned kScheduled = 2;
  return static_cast<clockid_t>((~static_cast<unsigned>(thread) << 3U) | kPerThread | kScheduled);
}

class LinuxProcessorTimes final : public ProcessorTimes {
 public:
  [[nodiscard]] Duration of_process() const noexcept override { return used(CLOCK_PROCESS_CPUTIME_ID); }
  [[nodiscard]] Duration of_thread(pid_t thread) const noexcept override {
    return used(thread_clock(thread));
  }
};

}  // namespace

const ProcessorTimes& linux_processor_times() noexcept {
  static const LinuxProcessorTimes times;
  return times;
}

}  // namespace plchost
