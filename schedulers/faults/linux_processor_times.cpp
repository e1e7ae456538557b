#include <array>
#include <chrono>
#include <string_view>

#include <fcntl.h>
#include <fmt/format.h>
#include <time.h>
#include <unistd.h>

#include "schedulers/faults/processor_times.hpp"
#include "shm/base/unique_fd.hpp"

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

// "1234 (name) S 1 ...": the name may hold anything, the state follows its last bracket.
bool says_asleep(std::string_view stat) noexcept {
  const std::size_t bracket = stat.rfind(')');
  if (bracket == std::string_view::npos || bracket + 2 >= stat.size()) return false;
  const char state = stat[bracket + 2];
  return state == 'S' || state == 'D' || state == 'I';
}

class LinuxProcessorTimes final : public ProcessorTimes {
 public:
  [[nodiscard]] Duration of_process() const noexcept override { return used(CLOCK_PROCESS_CPUTIME_ID); }
  [[nodiscard]] Duration of_thread(pid_t thread) const noexcept override {
    return used(thread_clock(thread));
  }
  [[nodiscard]] bool sleeps(pid_t thread) const noexcept override {
    std::array<char, 48> path{};
    *fmt::format_to_n(path.data(), path.size() - 1, "/proc/self/task/{}/stat", thread).out = '\0';
    const UniqueFd file(::open(path.data(), O_RDONLY | O_CLOEXEC));
    std::array<char, 128> stat{};
    const ssize_t got = file ? ::read(file.get(), stat.data(), stat.size()) : -1;
    return got > 0 && says_asleep({stat.data(), static_cast<std::size_t>(got)});
  }
};

}  // namespace

const ProcessorTimes& linux_processor_times() noexcept {
  static const LinuxProcessorTimes times;
  return times;
}

}  // namespace plchost
