#include <cstdint>

#include <fcntl.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <unistd.h>

#include "shm/base/system_call.hpp"
#include "shm/base/unique_fd.hpp"
#include "tests/bench/bench.hpp"

namespace plchost::bench {

Result<void> prepare_process() {
  if (::mlockall(MCL_CURRENT | MCL_FUTURE) != 0) return failure(ErrorCode::system, "mlockall", errno);
  ::prctl(PR_SET_TIMERSLACK, 1UL);
  // Held until the process ends, for the floors exactly as for what is measured beside them.
  UniqueFd latency(::open("/dev/cpu_dma_latency", O_WRONLY | O_CLOEXEC));
  const std::int32_t zero = 0;
  if (!latency || ::write(latency.get(), &zero, sizeof zero) != static_cast<ssize_t>(sizeof zero)) return {};
  (void)latency.release();
  return {};
}

Result<void> bind_thread(int core) {
  cpu_set_t set;
  CPU_ZERO(&set);
  CPU_SET(static_cast<std::size_t>(core), &set);
  if (::sched_setaffinity(0, sizeof set, &set) != 0) {
    return failure(ErrorCode::system, "bind to core " + std::to_string(core), errno);
  }
  return {};
}

}  // namespace plchost::bench
