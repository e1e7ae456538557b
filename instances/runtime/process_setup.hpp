#pragma once

#include <string>
#include <vector>

#include "shm/base/result.hpp"
#include "shm/base/unique_fd.hpp"

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

/// Takes the instance's name for this process, as long as the descriptor is open. already_exists: another
/// live process runs under that name in that pool.
[[nodiscard]] Result<UniqueFd> claim_name(const std::string& pool, const std::string& instance);

}  // namespace plchost
