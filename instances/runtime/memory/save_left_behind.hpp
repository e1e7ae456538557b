#pragma once

#include <string>

#include "instances/launch/launch_contract.hpp"
#include "shm/base/result.hpp"

namespace plchost {

/// Writes what the retain memory of an instance holds to the instance's retain files, unless they hold it
/// already. For the time after the end of the instance's process. `launch`: name, pool, settings and state
/// directory. not_found: there is no place for the files. busy: a process has them. Other errors: the files
/// are as they were. Set-up.
[[nodiscard]] Result<void> save_left_behind(const LaunchOptions& launch);

}  // namespace plchost
