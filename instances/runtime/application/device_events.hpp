#pragma once

#include <span>

#include "instances/runtime/settings/device_description.hpp"
#include "instances/runtime/tasks/event_table.hpp"
#include "schedulers/tasks/task_config.hpp"
#include "shm/base/result.hpp"

namespace plchost {

/// All that the device offers can be posted to from now on. Set-up.
[[nodiscard]] Result<void> register_device_events(const DeviceDescription& device, EventTable& events);
/// invalid_argument: a task waits for an event that the device does not offer; names those that it does.
/// Set-up.
[[nodiscard]] Result<void> check_device_events(const DeviceDescription& device,
                                               std::span<const TaskConfig> tasks);

}  // namespace plchost
