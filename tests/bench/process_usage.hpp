#pragma once

#include <string_view>

#include <sys/types.h>

#include "shm/base/result.hpp"
#include "shm/base/time.hpp"

namespace plchost::bench {

/// The memory of a process that is in RAM. `pss`: a page that several processes share counts with its share.
struct ProcessMemory {
  double rss_mib = 0;
  double pss_mib = 0;
};

/// The text of /proc/PID/smaps_rollup.
[[nodiscard]] Result<ProcessMemory> parse_memory(std::string_view text);
[[nodiscard]] Result<ProcessMemory> memory_of(pid_t process);

/// The time that all processors together had nothing to do, in the text of /proc/stat.
[[nodiscard]] Result<Duration> parse_idle_time(std::string_view text);
[[nodiscard]] Result<Duration> idle_time();

/// The processor time of all threads of another process since its start.
[[nodiscard]] Result<Duration> processor_time_of(pid_t process);

}  // namespace plchost::bench
