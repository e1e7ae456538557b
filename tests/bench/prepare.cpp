#include <algorithm>
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

Result<void> bind_thread(const std::vector<int>& cores) {
  cpu_set_t set;
  CPU_ZERO(&set);
  for (const int core : cores) CPU_SET(static_cast<std::size_t>(core), &set);
  if (::sched_setaffinity(0, sizeof set, &set) != 0) {
    return failure(ErrorCode::system, "bind a thread to its core", errno);
  }
  return {};
}

OnCore::OnCore(int core) {
  if (auto before = allowed_cores(0)) before_ = *before;
  (void)bind_thread({core});
}

OnCore::~OnCore() {
  if (!before_.empty()) (void)bind_thread(before_);
}

Result<void> alternate(const Plan& plan, const std::vector<Subject>& subjects, Duration longest) {
  const Duration slice = std::min({plan.slice, plan.each, longest});
  for (int turn = 0; turn < plan.slices(slice); ++turn) {
    for (const Subject& run : subjects) {
      if (auto done = run(slice); !done) return done;
    }
  }
  return {};
}

}  // namespace plchost::bench
