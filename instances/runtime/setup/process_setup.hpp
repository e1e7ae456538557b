#pragma once

#include <optional>
#include <string>
#include <vector>

#include "instances/launch/launch_contract.hpp"
#include "shm/base/result.hpp"
#include "shm/files/lock_file.hpp"

namespace plchost {

/// Binds this process to the cores (empty: leaves it where it is) and returns what the kernel granted.
/// refused: that is something else than was asked for; the text lists the cores on line.
[[nodiscard]] Result<std::vector<int>> bind_to_cores(const std::vector<int>& cores);

/// Memory locked, timer slack 1 ns, as many files as the hard limit allows. Each may be refused where a right
/// is missing: then `remark` says so and what to change, and the instance runs with worse latency.
struct RealTimeSetup {
  bool memory_locked = false;
  std::string remark;  ///< empty: all was granted
};
[[nodiscard]] RealTimeSetup set_up_real_time();

/// The instance's name, taken for this process as long as it is there. It is locks on files that nobody else
/// can hold. One is in the run directory, into which only the manager's user can write, and one beside the
/// pool, for instances without a run directory.
struct NameClaim {
  NameClaim() = default;
  NameClaim(NameClaim&& other) noexcept = default;
  NameClaim& operator=(NameClaim&& other) noexcept = default;
  ~NameClaim();
  std::optional<LockFile> in_run_directory;
  std::optional<LockFile> in_pool;
};
/// already_exists: another process runs under that name in that pool. refused: another user has put something
/// in the place of the lock, and it cannot be taken away. Set-up.
[[nodiscard]] Result<NameClaim> claim_name(const LaunchOptions& launch);

}  // namespace plchost
