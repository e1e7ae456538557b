#include "tests/bench/process_usage.hpp"

#include <charconv>
#include <fstream>
#include <iterator>
#include <sstream>
#include <string>

#include <fmt/format.h>
#include <time.h>
#include <unistd.h>

#include "shm/base/system_call.hpp"

namespace plchost::bench {

namespace {

/// "Pss:   1234 kB", in MiB.
Result<double> mib_after(std::string_view text, std::string_view key) {
  constexpr double kKibPerMib = 1024;
  const std::string head = fmt::format("\n{}:", key);
  const auto line = text.find(head);
  const auto digits = line == std::string_view::npos ? line : text.find_first_not_of(' ', line + head.size());
  std::uint64_t kib = 0;
  if (digits == std::string_view::npos ||
      std::from_chars(text.data() + digits, text.data() + text.size(), kib).ec != std::errc()) {
    return failure(ErrorCode::corrupt, fmt::format("memory of a process: no '{}'", key));
  }
  return static_cast<double>(kib) / kKibPerMib;
}

}  // namespace

Result<ProcessMemory> parse_memory(std::string_view text) {
  PLCHOST_TRY_ASSIGN(const double rss, mib_after(text, "Rss"));
  PLCHOST_TRY_ASSIGN(const double pss, mib_after(text, "Pss"));
  return ProcessMemory{.rss_mib = rss, .pss_mib = pss};
}

Result<ProcessMemory> memory_of(pid_t process) {
  std::ifstream file(fmt::format("/proc/{}/smaps_rollup", process));
  if (!file) return failure(ErrorCode::not_found, fmt::format("memory of process {}: it has ended", process));
  return parse_memory(std::string(std::istreambuf_iterator<char>(file), {}));
}

Result<Duration> parse_idle_time(std::string_view text) {
  // "cpu  user nice system idle ...", in ticks of the clock
  constexpr int kIdle = 4;
  std::istringstream words{std::string(text)};
  std::string head;
  std::int64_t ticks = 0;
  words >> head;
  for (int i = 0; i < kIdle; ++i) words >> ticks;
  if (head != "cpu" || !words) return failure(ErrorCode::corrupt, "/proc/stat: no line 'cpu'");
  return Duration(std::chrono::seconds(ticks)) / ::sysconf(_SC_CLK_TCK);
}

Result<Duration> idle_time() {
  std::ifstream file("/proc/stat");
  return parse_idle_time(std::string(std::istreambuf_iterator<char>(file), {}));
}

Result<Duration> processor_time_of(pid_t process) {
  clockid_t clock = 0;
  PLCHOST_TRY(check_returned(::clock_getcpuclockid(process, &clock),
                             fmt::format("processor time of process {}", process)));
  timespec time{};
  PLCHOST_TRY(
      check_errno(::clock_gettime(clock, &time), fmt::format("processor time of process {}", process)));
  return std::chrono::seconds(time.tv_sec) + std::chrono::nanoseconds(time.tv_nsec);
}

}  // namespace plchost::bench
