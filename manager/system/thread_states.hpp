#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <sys/types.h>

#include "shm/base/time.hpp"

namespace plchost {

/// A thread of any process of this host, as the kernel tells it to everybody (/proc/PID/task/TID/stat).
struct ThreadState {
  pid_t process = 0;
  pid_t id = 0;
  std::string name;
  bool ready = false;  ///< it runs, or waits for nothing but a processor
  Duration used{};     ///< processor time, in steps of 10 ms
  int nice = 0;
  int core = -1;        ///< that it ran on last, or waits for
  int priority = 0;     ///< 1 to 99 under SCHED_FIFO and SCHED_RR; else 0
  unsigned policy = 0;  ///< SCHED_FIFO, ...
};

/// From the text of such a file; nothing: it is none.
[[nodiscard]] std::optional<ThreadState> parse_thread_state(std::string_view text);

/// The threads of one process; empty: it has ended, or others may not look at it.
[[nodiscard]] std::vector<ThreadState> threads_of_process(pid_t process);

/// The thread that takes a processor before all others: of threads that are ready on one of `cores`, the one
/// with the highest priority. Those of process `spared` do not count. Nothing: no other is ready there. Reads
/// one file for each thread of the host.
[[nodiscard]] std::optional<ThreadState> first_on_cores(const std::vector<int>& cores, pid_t spared);

/// "program 'chrt' (process 812, SCHED_FIFO 50)", with the thread's name if it has one of its own.
[[nodiscard]] std::string describe(const ThreadState& thread);

}  // namespace plchost
