#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

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

/// The external events that the operator has registered, kept beside the control socket in
/// "RUN_DIRECTORY/NAME.events", one name per line: they outlive the process, until the operator unregisters
/// them.
[[nodiscard]] std::string operator_events_path(std::string_view run_directory, std::string_view instance);

/// Empty if there is no such file. Lines that are no event names are left out. system: it cannot be opened.
[[nodiscard]] Result<std::vector<std::string>> read_operator_events(const std::string& path);

/// Replaces the file as a whole, or removes it if there are none.
[[nodiscard]] Result<void> write_operator_events(const std::string& path,
                                                 const std::vector<std::string>& events);

}  // namespace plchost
