#include "tests/bench/thread_usage.hpp"

#include <charconv>
#include <filesystem>
#include <fstream>
#include <string>

#include <time.h>
#include <unistd.h>

namespace plchost::bench {

namespace {

// The clock id of another thread, as pthread_getcpuclockid makes it: exact, where /proc counts what is
// sampled.
Duration cpu_time_of(pid_t thread) {
  constexpr unsigned kPerThread = 4;
  constexpr unsigned kScheduled = 2;
  const auto id = static_cast<clockid_t>((~static_cast<unsigned>(thread) << 3U) | kPerThread | kScheduled);
  timespec time{};
  if (::clock_gettime(id, &time) != 0) return {};
  return std::chrono::seconds(time.tv_sec) + std::chrono::nanoseconds(time.tv_nsec);
}

bool read_value(std::string_view line, std::string_view key, std::uint64_t& into) {
  if (!line.starts_with(key)) return false;
  line.remove_prefix(line.find_first_not_of(" \t", key.size()));
  return std::from_chars(line.data(), line.data() + line.size(), into).ec == std::errc();
}

}  // namespace

ThreadUsage& ThreadUsage::operator+=(const ThreadUsage& other) noexcept {
  cpu += other.cpu;
  voluntary += other.voluntary;
  involuntary += other.involuntary;
  return *this;
}

ThreadUsage usage_of_other_threads(std::string_view name) {
  ThreadUsage sum;
  const auto self = std::to_string(::gettid());
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/task", error)) {
    const std::string thread = entry.path().filename();
    if (thread == self) continue;
    ThreadUsage one{.cpu = cpu_time_of(std::stoi(thread))};
    bool wanted = true;
    std::ifstream status(entry.path() / "status");
    for (std::string line; std::getline(status, line);) {
      if (line.starts_with("Name:")) wanted = name.empty() || line.ends_with("\t" + std::string(name));
      if (!read_value(line, "voluntary_ctxt_switches:", one.voluntary))
        (void)read_value(line, "nonvoluntary_ctxt_switches:", one.involuntary);
    }
    if (wanted) sum += one;
  }
  return sum;
}

}  // namespace plchost::bench
