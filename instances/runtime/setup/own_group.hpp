#pragma once

#include <string>

#include "instances/launch/launch_contract.hpp"

namespace plchost {

/// Moves this process into its control group, and takes its OOM score. All that it allocates, starts and
/// forks afterwards counts there. Before the process has other rights, threads or an application. In words,
/// the part that was refused; empty: none. The process goes on without it.
[[nodiscard]] std::string take_own_group(const LaunchOptions& launch);

}  // namespace plchost
