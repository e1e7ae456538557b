#pragma once

#include <string>

#include "control.h"
#include "shm/pages/host_page.hpp"
#include "shm/pages/instance_page.hpp"

namespace plchost {

/// The part of an instance's status that only its process knows: tick source, idle states, distributed clock.
/// A feature that is not in use leaves its members as they are.
void put_runtime(const InstanceRuntime& runtime, plc_InstanceStatus& sample) noexcept;
/// InstanceStatus.problem: the manager's text, and the one that only the process knows. `runtime`: of any
/// process of it, or null.
[[nodiscard]] std::string problem_of_instance(const InstanceStatus& status, const InstanceRuntime* runtime);

}  // namespace plchost
