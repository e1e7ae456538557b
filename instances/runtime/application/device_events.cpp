#include "instances/runtime/application/device_events.hpp"

#include <algorithm>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "shm/base/names.hpp"

namespace plchost {

Result<void> register_device_events(const DeviceDescription& device, EventTable& events) {
  for (const std::string& event : device.events) {
    if (auto done = events.register_by_device(event); !done) {
      return failure_in("event of the device description", std::move(done).error());
    }
  }
  return {};
}

Result<void> check_device_events(const DeviceDescription& device, std::span<const TaskConfig> tasks) {
  for (const TaskConfig& task : tasks) {
    if (!traits_of(task.kind).names_event) continue;
    if (!device.supports_external) {
      return failure(
          ErrorCode::invalid_argument,
          fmt::format("task '{}' waits for an external event, which the device description does not allow: "
                      "its supportexternal is not 1",
                      task.name));
    }
    if (std::ranges::find(device.events, task.external_event) != device.events.end()) continue;
    return failure(
        ErrorCode::invalid_argument,
        fmt::format("task '{}' waits for external event '{}', which the device description does not name; "
                    "it names: {}",
                    task.name, task.external_event,
                    device.events.empty() ? "none" : join_some(device.events)));
  }
  return {};
}

}  // namespace plchost
