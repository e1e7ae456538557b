#include "shm/process/work_limit.hpp"

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <system_error>
#include <vector>

#include <fmt/format.h>
#include <time.h>

namespace plchost {

namespace {

// Against one that forks all the time.
constexpr std::size_t kMostProcesses = 256;

// The second of three numbers.
Duration time_waited(const std::filesystem::path& thread) {
  std::ifstream file(thread / "schedstat");
  std::int64_t ran = 0;
  std::int64_t waited = 0;
  return file >> ran >> waited ? Duration(waited) : Duration::zero();
}

}  // namespace

Duration processor_time_of(pid_t process) noexcept {
  clockid_t clock{};
  timespec time{};
  if (::clock_getcpuclockid(process, &clock) != 0 || ::clock_gettime(clock, &time) != 0)
    return Duration::zero();
  return std::chrono::seconds(time.tv_sec) + Duration(time.tv_nsec);
}

ProcessorShare processor_share_of(pid_t process) {
  ProcessorShare share;
  std::vector<pid_t> processes{process};
  for (std::size_t i = 0; i < processes.size() && i < kMostProcesses; ++i) {
    share.ran += processor_time_of(processes[i]);
    std::error_code error;
    const std::filesystem::path folder = fmt::format("/proc/{}/task", processes[i]);
    // Advanced by hand: the range-based form throws when a process ends in between.
    for (std::filesystem::directory_iterator at(folder, error), end; !error && at != end;
         at.increment(error)) {
      share.waited += time_waited(at->path());
      std::ifstream children(at->path() / "children");
      for (pid_t child = 0; children >> child;) processes.push_back(child);
    }
  }
  return share;
}

}  // namespace plchost
