#include "shm/base/process_start.hpp"

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
#include <unistd.h>

#include "shm/base/unique_fd.hpp"

namespace plchost {

namespace {

constexpr std::size_t kStatBytes = 1024;  // some 50 numbers and a name of 16 bytes
constexpr int kStateField = 3;
constexpr int kThreadsField = 20;
constexpr int kStartField = 22;
constexpr std::uint64_t kUnknownStart = 1;  // without /proc; no thread of ours is as old as the first tick

struct Stat {
  char state = '?';
  std::uint64_t threads = 0;
  std::uint64_t start = 0;
};

// The second field is the program's name in brackets, which may hold brackets and blanks itself.
std::optional<Stat> parse(std::string_view text) noexcept {
  const std::size_t bracket = text.rfind(')');
  if (bracket == std::string_view::npos) return std::nullopt;
  Stat stat;
  std::string_view rest = text.substr(bracket + 1);
  for (int field = kStateField; field <= kStartField; ++field) {
    const std::size_t begin = rest.find_first_not_of(' ');
    if (begin == std::string_view::npos) return std::nullopt;
    rest.remove_prefix(begin);
    const std::string_view word = rest.substr(0, rest.find(' '));
    if (field == kStateField) stat.state = word.front();
    if (field == kThreadsField) std::from_chars(word.data(), word.data() + word.size(), stat.threads);
    if (field == kStartField) std::from_chars(word.data(), word.data() + word.size(), stat.start);
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
  return got > 0 ? parse({text.data(), static_cast<std::size_t>(got)}) : std::nullopt;
}

bool thread_is_over(const Stat& stat) noexcept {
  return stat.state == 'X' || stat.state == 'x' || stat.state == 'Z';
}

// A process whose first thread has ended looks like a zombie, and is none while others live on.
bool process_is_over(const Stat& stat) noexcept {
  return thread_is_over(stat) && stat.threads <= 1;
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

bool process_has_ended(pid_t process, std::uint64_t start) noexcept {
  if (process <= 0 || !exists(process)) return true;
  const auto stat = read_stat(process);
  return stat && (stat->start != start || process_is_over(*stat));
}

std::optional<std::uint64_t> start_of_thread(pid_t thread) noexcept {
  if (thread <= 0 || !exists(thread)) return std::nullopt;
  const auto stat = read_stat(thread);
  if (!stat) return 0;
  return thread_is_over(*stat) ? std::nullopt : std::optional(stat->start);
}

const ThreadIdentity& this_thread() noexcept {
  if (identity.id == 0) {
    [[maybe_unused]] static const int forgotten_in_children =
        ::pthread_atfork(nullptr, nullptr, [] { identity = {}; });
    const pid_t self = ::gettid();
    const auto stat = read_stat(self);
    identity = {.id = static_cast<std::uint32_t>(self), .start = stat ? stat->start : kUnknownStart};
  }
  return identity;
}

}  // namespace plchost
