#include "manager/system/thread_states.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <system_error>
#include <tuple>

#include <fmt/format.h>
#include <sched.h>
#include <unistd.h>

namespace plchost {

namespace {

// Fields of the file, as proc(5) numbers them. The state is the first one behind the name.
constexpr std::size_t kState = 3;
constexpr std::size_t kUserTime = 14;
constexpr std::size_t kSystemTime = 15;
constexpr std::size_t kNice = 19;
constexpr std::size_t kProcessor = 39;
constexpr std::size_t kPriority = 40;
constexpr std::size_t kPolicy = 41;
constexpr unsigned kDeadline = 6;  // SCHED_DEADLINE, which <sched.h> does not name everywhere

std::string text_of(const std::filesystem::path& path) {
  std::ifstream file(path);
  std::string text;
  std::getline(file, text, '\0');
  while (text.ends_with('\n')) text.pop_back();
  return text;
}

std::optional<std::int64_t> number_in(std::string_view word) noexcept {
  std::int64_t number = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), number);
  if (error != std::errc{} || end != word.data() + word.size()) return std::nullopt;
  return number;
}

std::vector<pid_t> numbers_in(const std::filesystem::path& folder) {
  std::vector<pid_t> numbers;
  std::error_code error;
  // Advanced by hand: the range-based form throws when a process ends in between.
  for (std::filesystem::directory_iterator at(folder, error), end; !error && at != end; at.increment(error)) {
    const std::string name = at->path().filename();
    if (const auto number = number_in(name)) numbers.push_back(static_cast<pid_t>(*number));
  }
  return numbers;
}

// Of two that are ready, the kernel runs the greater one first.
auto rank(const ThreadState& thread) noexcept {
  return std::tuple(thread.policy == kDeadline, thread.priority, -thread.nice);
}

std::string how_it_is_ordered(const ThreadState& thread) {
  switch (thread.policy) {
    case SCHED_FIFO:
      return fmt::format("SCHED_FIFO {}", thread.priority);
    case SCHED_RR:
      return fmt::format("SCHED_RR {}", thread.priority);
    case kDeadline:
      return "SCHED_DEADLINE";
    default:
      return fmt::format("nice {}", thread.nice);
  }
}

}  // namespace

std::optional<ThreadState> parse_thread_state(std::string_view text) {
  ThreadState thread;
  const std::size_t open = text.find(" (");
  const std::size_t close = text.rfind(") ");  // the name may hold anything
  if (open == std::string_view::npos || close == std::string_view::npos || close < open + 2)
    return std::nullopt;
  const auto id = number_in(text.substr(0, open));
  if (!id) return std::nullopt;
  thread.id = static_cast<pid_t>(*id);
  thread.name = text.substr(open + 2, close - open - 2);
  std::array<std::int64_t, kPolicy + 1> fields{};
  std::string_view rest = text.substr(close + 2);
  for (std::size_t field = kState; field <= kPolicy; ++field) {
    const std::string_view word = rest.substr(0, rest.find(' '));
    if (word.empty()) return std::nullopt;
    if (field == kState) {
      thread.ready = word == "R";
    } else {
      fields.at(field) = number_in(word).value_or(0);
    }
    rest.remove_prefix(std::min(word.size() + 1, rest.size()));
  }
  const std::int64_t ticks = fields[kUserTime] + fields[kSystemTime];
  thread.used = Duration(std::chrono::seconds(1)) * ticks / ::sysconf(_SC_CLK_TCK);
  thread.nice = static_cast<int>(fields[kNice]);
  thread.core = static_cast<int>(fields[kProcessor]);
  thread.priority = static_cast<int>(fields[kPriority]);
  thread.policy = static_cast<unsigned>(fields[kPolicy]);
  return thread;
}

std::vector<ThreadState> threads_of_process(pid_t process) {
  std::vector<ThreadState> threads;
  const std::filesystem::path folder = fmt::format("/proc/{}/task", process);
  for (const pid_t id : numbers_in(folder)) {
    auto thread = parse_thread_state(text_of(folder / std::to_string(id) / "stat"));
    if (!thread) continue;  // it has ended
    thread->process = process;
    threads.push_back(*std::move(thread));
  }
  return threads;
}

std::optional<ThreadState> first_on_cores(const std::vector<int>& cores, pid_t spared) {
  std::optional<ThreadState> first;
  const pid_t self = ::getpid();
  for (const pid_t process : numbers_in("/proc")) {
    if (process == spared || process == self) continue;
    for (ThreadState& thread : threads_of_process(process)) {
      if (!thread.ready || std::ranges::find(cores, thread.core) == cores.end()) continue;
      if (!first || rank(*first) < rank(thread)) first = std::move(thread);
    }
  }
  return first;
}

std::string describe(const ThreadState& thread) {
  const std::string program = text_of(fmt::format("/proc/{}/comm", thread.process));
  const bool own_name = !program.empty() && thread.name != program;
  return fmt::format("program '{}' (process {}, {}{})", program.empty() ? thread.name : program,
                     thread.process, own_name ? fmt::format("thread '{}', ", thread.name) : "",
                     how_it_is_ordered(thread));
}

}  // namespace plchost
