#include "instances/runtime/setup/process_setup.hpp"

#include <fmt/format.h>
#include <linux/capability.h>
#include <malloc.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>

#include "shm/base/cpu_list.hpp"
#include "shm/base/system_call.hpp"
#include "shm/files/memory_file.hpp"
#include "shm/log/log.hpp"
#include "shm/pages/instance_page.hpp"
#include "shm/threads/thread.hpp"

namespace plchost {

namespace {

bool has_capability(unsigned capability) {
  __user_cap_header_struct header{.version = _LINUX_CAPABILITY_VERSION_3, .pid = 0};
  __user_cap_data_struct sets[_LINUX_CAPABILITY_U32S_3] =
      {};  // NOLINT(modernize-avoid-c-arrays): the kernel's
  if (::syscall(SYS_capget, &header, &sets) != 0) return false;
  return (sets[CAP_TO_INDEX(capability)].effective & CAP_TO_MASK(capability)) != 0;
}

// With locked memory no page of ours is ever swapped or faulted in late. Then malloc shall neither give
// memory back (M_TRIM_THRESHOLD) nor map large blocks anew each time (M_MMAP_MAX): both would bring the
// faults back.
Result<void> lock_memory() {
  rlimit limit{};
  ::getrlimit(RLIMIT_MEMLOCK, &limit);
  if (!has_capability(CAP_IPC_LOCK) && limit.rlim_cur != RLIM_INFINITY) {
    // Under a limit the lock may succeed now and make a later thread's stack fail: better none than half.
    return failure(ErrorCode::refused,
                   fmt::format("the limit for locked memory is {} KiB: give the process CAP_IPC_LOCK or "
                               "LimitMEMLOCK=infinity",
                               limit.rlim_cur / 1024));
  }
  PLCHOST_TRY(check_errno(::mlockall(MCL_CURRENT | MCL_FUTURE), "cannot lock the memory (mlockall)"));
  ::mallopt(M_TRIM_THRESHOLD, -1);
  ::mallopt(M_MMAP_MAX, 0);
  return {};
}

// CmpScheduleTimer has two timers per task, and the usual soft limit is 1,024 files. It is that low for
// select(), which nothing here calls.
void allow_many_files() {
  rlimit limit{};
  if (::getrlimit(RLIMIT_NOFILE, &limit) != 0) return;
  limit.rlim_cur = limit.rlim_max;
  ::setrlimit(RLIMIT_NOFILE, &limit);
}

}  // namespace

Result<std::vector<int>> bind_to_cores(const std::vector<int>& cores) {
  if (cores.empty()) return allowed_cores(0);
  const auto wanted = each_once(cores);
  const auto online = online_cores();
  const std::string known = online ? fmt::format("; on line are {}", fmt::join(*online, ",")) : std::string();
  auto granted = bind_process_to_cores(0, wanted);
  if (!granted) {
    granted.error().message += known;
    return granted;
  }
  if (*granted != wanted) {
    return failure(ErrorCode::refused, fmt::format("cores {} were asked for, the kernel granted {}{}",
                                                   fmt::join(wanted, ","), fmt::join(*granted, ","), known));
  }
  return granted;
}

RealTimeSetup set_up_real_time() {
  RealTimeSetup setup;
  std::vector<std::string> remarks;
  allow_many_files();
  const auto locked = lock_memory();
  setup.memory_locked = locked.has_value();
  if (!locked) remarks.push_back(fmt::format("memory is not locked: {}", locked.error().describe()));
  // Threads inherit it. Only SCHED_OTHER has slack; FIFO threads have none anyway.
  if (::prctl(PR_SET_TIMERSLACK, 1UL, 0UL, 0UL, 0UL) != 0)
    remarks.emplace_back("the timer slack stays at 50 us");
  setup.remark = fmt::format("{}", fmt::join(remarks, "; "));
  return setup;
}

Result<NameClaim> claim_name(const LaunchOptions& launch) {
  const auto taken = [&](const Error& error) {
    return failure(ErrorCode::already_exists, fmt::format("an instance '{}' runs already in pool '{}': {}",
                                                          launch.name, launch.pool, error.message));
  };
  NameClaim claim;
  if (!launch.run_directory.empty()) {
    auto here = LockFile::take(instance_claim_path(launch.run_directory, launch.name));
    if (!here && here.error().code == ErrorCode::already_exists) return taken(here.error());
    if (!here) return failure_in("cannot claim the instance's name in the run directory", here.error());
    claim.in_run_directory.emplace(*std::move(here));
  }
  const std::string path = MemoryFile::path(instance_claim_name(launch.pool, launch.name));
  auto in_pool = LockFile::take(path);
  if (!in_pool && in_pool.error().code == ErrorCode::refused) {
    spdlog::warn("{}; it is removed and not used", in_pool.error().describe());
    in_pool = and_then(take_away(path), [&] { return LockFile::take(path); });
  }
  if (in_pool) {
    claim.in_pool.emplace(*std::move(in_pool));
  } else if (in_pool.error().code == ErrorCode::already_exists) {
    return taken(in_pool.error());
  } else if (claim.in_run_directory) {
    // Only the manager and instances write into the run directory: the name is ours without the other one.
    spdlog::warn("{}", in_pool.error().describe());
  } else {
    return std::unexpected(in_pool.error());
  }
  return claim;
}

NameClaim::~NameClaim() {
  if (in_pool) in_pool->remove();
}

}  // namespace plchost
