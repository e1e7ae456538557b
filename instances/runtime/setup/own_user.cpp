#include "instances/runtime/setup/own_user.hpp"

#include <vector>

#include <fmt/format.h>
#include <linux/capability.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include "shm/base/system_call.hpp"
#include "shm/files/memory_file.hpp"
#include "shm/process/capabilities.hpp"
#include "shm/process/user_account.hpp"

namespace plchost {

namespace {

constexpr rlim_t kEachPriority = 99;  // of SCHED_FIFO

// Whether the process may go so far without a capability, now or after the limit is raised.
bool allows(decltype(RLIMIT_RTPRIO) what, rlim_t most) {
  rlimit limit{};
  if (::getrlimit(what, &limit) != 0) return false;
  if (limit.rlim_cur >= most) return true;
  const rlimit raised{.rlim_cur = most, .rlim_max = most > limit.rlim_max ? most : limit.rlim_max};
  return ::setrlimit(what, &raised) == 0;
}

Result<void> keep_real_time_rights(bool priorities, bool memory) {
  if (priorities && memory) return give_up_all_capabilities();
  if (priorities) return keep_capabilities({CAP_IPC_LOCK});
  if (memory) return keep_capabilities({CAP_SYS_NICE});
  return keep_capabilities({CAP_SYS_NICE, CAP_IPC_LOCK});
}

// A pool for the group of firmware is for instances, too.
void add_group_of(const std::string& pool, UserAccount& user) {
  struct stat status{};
  const bool plain = ::lstat(MemoryFile::path(pool).c_str(), &status) == 0 && S_ISREG(status.st_mode);
  if (plain && status.st_gid != 0) user.groups.push_back(status.st_gid);
}

}  // namespace

Result<std::string> become_user_of_instances(const std::string& user, const std::string& pool) {
  PLCHOST_TRY_ASSIGN(auto account, find_user(user));
  add_group_of(pool, account);
  PLCHOST_TRY(refuse_new_rights());
  const bool priorities = allows(RLIMIT_RTPRIO, kEachPriority);
  const bool memory = allows(RLIMIT_MEMLOCK, RLIM_INFINITY);
  PLCHOST_TRY(check_errno(::prctl(PR_SET_KEEPCAPS, 1, 0, 0, 0), "cannot keep capabilities"));
  PLCHOST_TRY(take_user(account));
  PLCHOST_TRY(check_errno(::prctl(PR_SET_KEEPCAPS, 0, 0, 0, 0), "cannot give up capabilities"));
  PLCHOST_TRY(keep_real_time_rights(priorities, memory));
  std::vector<std::string_view> kept;
  if (!priorities) kept.emplace_back("CAP_SYS_NICE");
  if (!memory) kept.emplace_back("CAP_IPC_LOCK");
  return fmt::format(
      "runs as user {}, {}", account.number,
      kept.empty() ? "without capabilities" : fmt::format("with {} only", fmt::join(kept, " and ")));
}

}  // namespace plchost
