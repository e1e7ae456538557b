#include "shm/threads/process_start.hpp"

#include <array>
#include <cerrno>
#include <charconv>
#include <cstddef>
#include <string_view>

#include <fcntl.h>
#include <fmt/format.h>
#include <pthread.h>
#include <signal.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#include "shm/base/unique_fd.hpp"

namespace plchost {

namespace {

constexpr std::size_t kStatBytes = 1024;  // some 50 numbers and a name of 16 bytes
constexpr int kStateField = 3;
constexpr int kFlagsField = 9;
constexpr int kThreadsField = 20;
constexpr int kStartField = 22;
constexpr int kCodeField = 26;
constexpr int kStackField = 28;
constexpr std::uint64_t kEnding = 4;  // PF_EXITING of the kernel

struct Stat {
  char state = '?';
  std::uint64_t threads = 0;
  std::uint64_t start = 0;
  std::uint64_t flags = 0;
  std::uint64_t code = 0;
  std::uint64_t stack = 0;
};

// 0 or 1 for the place of the code is the host's way to say that it does not tell.
std::uint32_t image_of(const Stat& stat) noexcept {
  if (stat.code <= 1 || stat.stack <= 1) return 0;
  constexpr std::uint64_t kMix = 0x9e3779b97f4a7c15;
  const std::uint64_t mixed = ((stat.code * kMix) ^ stat.stack) * kMix;
  return static_cast<std::uint32_t>(mixed >> 32U) | 1U;
}

// The second field is the program's name in brackets, which may hold brackets and blanks itself.
std::optional<Stat> parse_stat(std::string_view text) noexcept {
  const std::size_t bracket = text.rfind(')');
  if (bracket == std::string_view::npos) return std::nullopt;
  Stat stat;
  std::string_view rest = text.substr(bracket + 1);
  for (int field = kStateField; field <= kStackField; ++field) {
    const std::size_t begin = rest.find_first_not_of(' ');
    if (begin == std::string_view::npos) return std::nullopt;
    rest.remove_prefix(begin);
    const std::string_view word = rest.substr(0, rest.find(' '));
    if (field == kStateField) stat.state = word.front();
    const auto read = [&](std::uint64_t& to) { std::from_chars(word.data(), word.data() + word.size(), to); };
    if (field == kFlagsField) read(stat.flags);
    if (field == kThreadsField) read(stat.threads);
    if (field == kStartField) read(stat.start);
    if (field == kCodeField) read(stat.code);
    if (field == kStackField) read(stat.stack);
    rest.remove_prefix(word.size());
  }
  return stat;
}

std::optional<Stat> read_stat(pid_t task) noexcept {
  std::array<char, 32> path{};
  fmt::format_to_n(path.begin(), path.size() - 1, "/proc/{}/stat", task);
  const UniqueFd fd(::open(path.data(), O_RDONLY | O_CLOEXEC));
  if (!fd) return std::nullopt;
  std::array<char, kStatBytes> text{};
  const ssize_t got = ::read(fd.get(), text.data(), text.size());
  return got > 0 ? parse_stat({text.data(), static_cast<std::size_t>(got)}) : std::nullopt;
}

bool thread_is_over(const Stat& stat) noexcept {
  return stat.state == 'X' || stat.state == 'x' || stat.state == 'Z';
}

// A process whose first thread has ended looks like a zombie, and is none while others live on.
bool process_is_over(const Stat& stat) noexcept {
  return thread_is_over(stat) && stat.threads <= 1;
}

// Now, in the unit of start_of(): the caller began before.
std::uint64_t this_tick() noexcept {
  timespec now{};
  ::clock_gettime(CLOCK_BOOTTIME, &now);
  constexpr std::uint64_t kNanoseconds = 1'000'000'000;
  const auto ticks = static_cast<std::uint64_t>(::sysconf(_SC_CLK_TCK));
  return static_cast<std::uint64_t>(now.tv_sec) * ticks +
         static_cast<std::uint64_t>(now.tv_nsec) * ticks / kNanoseconds;
}

bool exists(pid_t task) noexcept {
  return ::kill(task, 0) == 0 || errno != ESRCH;
}

thread_local ThreadIdentity identity;

}  // namespace

std::optional<std::uint64_t> start_of(pid_t process) noexcept {
  const auto stat = read_stat(process);
  if (!stat || process_is_over(*stat)) return std::nullopt;
  return stat->start;
}

ProcessIdentity this_process() noexcept {
  const pid_t self = ::getpid();
  const auto stat = read_stat(self);
  if (!stat) return {.pid = self, .start = this_tick()};
  return {.pid = self, .image = image_of(*stat), .start = stat->start};
}

std::uint64_t pid_namespace() noexcept {
  struct stat status{};
  return ::stat("/proc/self/ns/pid", &status) == 0 ? status.st_ino : 0;
}

bool process_has_ended(const ProcessIdentity& process, ProcessLook look) noexcept {
  if (process.pid <= 0 || !exists(process.pid)) return true;
  if (look == ProcessLook::quick) return false;
  const auto stat = read_stat(process.pid);
  if (!stat) return false;
  const std::uint32_t image = image_of(*stat);
  const bool another = image != 0 && process.image != 0 && image != process.image;
  return stat->start > process.start || another || process_is_over(*stat);
}

std::optional<ThreadLook> look_at_thread(pid_t thread) noexcept {
  if (thread <= 0 || !exists(thread)) return std::nullopt;
  const auto stat = read_stat(thread);
  if (!stat) return ThreadLook{};
  if (thread_is_over(*stat)) return std::nullopt;
  return ThreadLook{.start = stat->start, .image = image_of(*stat), .ending = (stat->flags & kEnding) != 0};
}

const ThreadIdentity& this_thread() noexcept {
  if (identity.id == 0) {
    [[maybe_unused]] static const int forgotten_in_children =
        ::pthread_atfork(nullptr, nullptr, [] { identity = {}; });
    const pid_t self = ::gettid();
    const auto stat = read_stat(self);
    identity = {.id = static_cast<std::uint32_t>(self),
                .start = stat ? stat->start : this_tick(),
                .image = stat ? image_of(*stat) : 0};
  }
  return identity;
}

}  // namespace plchost
