#include <array>
#include <charconv>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string_view>

#include <dirent.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <sched.h>
#include <sys/syscall.h>
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

// "1234 567 8": it ran for 1234 ns, and was ready for 567 ns.
Duration ready_time_in(std::string_view schedstat) noexcept {
  const std::size_t second = schedstat.find(' ') + 1;
  Duration::rep ready = 0;
  if (second > 0)
    (void)std::from_chars(schedstat.data() + second, schedstat.data() + schedstat.size(), ready);
  return Duration(ready);
}

// A file of /proc/self/task, as much of it as fits.
template <std::size_t Size>
std::string_view read_of_thread(pid_t thread, const char* file, std::array<char, Size>& text) noexcept {
  std::array<char, 48> path{};
  *fmt::format_to_n(path.data(), path.size() - 1, "/proc/self/task/{}/{}", thread, file).out = '\0';
  const UniqueFd fd(::open(path.data(), O_RDONLY | O_CLOEXEC));
  const ssize_t got = fd ? ::read(fd.get(), text.data(), text.size()) : -1;
  return {text.data(), static_cast<std::size_t>(got > 0 ? got : 0)};
}

// Without what the thread hands on to those that it makes; -1: it has ended.
int policy_of(pid_t thread) noexcept {
  const int policy = ::sched_getscheduler(thread);
  return policy < 0 ? policy : policy & ~SCHED_RESET_ON_FORK;
}

bool is_real_time(int policy) noexcept {
  return policy == SCHED_FIFO || policy == SCHED_RR;
}

/// The threads of this process, read without memory of the heap. Real-time.
class ThreadNumbers {
 public:
  ThreadNumbers() noexcept : folder_(::open("/proc/self/task", O_RDONLY | O_DIRECTORY | O_CLOEXEC)) {}
  /// 0: there are no more.
  [[nodiscard]] pid_t next() noexcept {
    while (folder_ && (at_ < got_ || fill())) {
      // As getdents64 writes it: the length of the entry, and behind its type the name.
      std::uint16_t length = 0;
      std::memcpy(&length, &bytes_[at_ + offsetof(dirent64, d_reclen)], sizeof length);
      const char* const name = &bytes_[at_ + offsetof(dirent64, d_name)];
      at_ += length;
      pid_t thread = 0;
      if (std::from_chars(name, name + std::strlen(name), thread).ec == std::errc{}) return thread;
    }
    return 0;
  }

 private:
  bool fill() noexcept {
    const auto got = ::syscall(SYS_getdents64, folder_.get(), bytes_.data(), bytes_.size());
    at_ = 0;
    got_ = got > 0 ? static_cast<std::size_t>(got) : 0;
    return got_ > 0;
  }

  UniqueFd folder_;
  std::array<char, 2048> bytes_{};
  std::size_t at_ = 0;
  std::size_t got_ = 0;
};

class LinuxProcessorTimes final : public ProcessorTimes {
 public:
  [[nodiscard]] Duration of_process() const noexcept override { return used(CLOCK_PROCESS_CPUTIME_ID); }
  [[nodiscard]] Duration of_thread(pid_t thread) const noexcept override {
    return used(thread_clock(thread));
  }
  [[nodiscard]] Duration ready_time_of_thread(pid_t thread) const noexcept override {
    std::array<char, 96> schedstat{};
    return ready_time_in(read_of_thread(thread, "schedstat", schedstat));
  }
  [[nodiscard]] bool sleeps(pid_t thread) const noexcept override {
    std::array<char, 128> stat{};
    return says_asleep(read_of_thread(thread, "stat", stat));
  }
  [[nodiscard]] std::size_t real_time_threads(std::span<pid_t> found) const noexcept override {
    ThreadNumbers threads;
    std::size_t count = 0;
    while (count < found.size()) {
      const pid_t thread = threads.next();
      if (thread == 0) break;
      if (is_real_time(policy_of(thread))) found[count++] = thread;
    }
    return count;
  }
  [[nodiscard]] ThreadText demote(pid_t thread) const noexcept override {
    const int whole = ::sched_getscheduler(thread);
    const int policy = policy_of(thread);
    sched_param before{};
    if (!is_real_time(policy) || ::sched_getparam(thread, &before) != 0) return {};
    const sched_param none{};
    if (::sched_setscheduler(thread, SCHED_OTHER | (whole & SCHED_RESET_ON_FORK), &none) != 0) return {};
    std::array<char, 16> file{};
    std::string_view name = read_of_thread(thread, "comm", file);
    if (name.ends_with('\n')) name.remove_suffix(1);
    ThreadText text;
    fmt::format_to_n(text.bytes.data(), text.bytes.size() - 1, "thread '{}' ({} {})", name,
                     policy == SCHED_FIFO ? "SCHED_FIFO" : "SCHED_RR", before.sched_priority);
    return text;
  }
};

}  // namespace

const ProcessorTimes& linux_processor_times() noexcept {
  static const LinuxProcessorTimes times;
  return times;
}

}  // namespace plchost
