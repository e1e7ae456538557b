#include "instances/runtime/tasks/registered_events.hpp"

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "shm/base/names.hpp"
#include "shm/files/replace_file.hpp"

namespace plchost {

Result<void> register_device_events(const DeviceDescription& device, EventTable& events) {
  for (const std::string& event : device.events) {
    PLCHOST_TRY(in_step("event of the device description", events.register_by_device(event)));
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

std::string operator_events_path(std::string_view run_directory, std::string_view instance) {
  return fmt::format("{}/{}.events", run_directory, instance);
}

Result<std::vector<std::string>> read_operator_events(const std::string& path) {
  std::vector<std::string> events;
  errno = 0;
  std::ifstream file(path);
  if (!file && errno != ENOENT) return failure(ErrorCode::system, "cannot open " + path, errno);
  for (std::string line; events.size() < EventTable::kMaxEvents && std::getline(file, line);) {
    if (check_name("event name", line, kMaxEventName)) events.push_back(std::move(line));
  }
  return events;
}

Result<void> write_operator_events(const std::string& path, const std::vector<std::string>& events) {
  std::error_code error;
  if (events.empty()) {
    std::filesystem::remove(path, error);
    if (error) return failure(ErrorCode::system, "cannot remove " + path, error.value());
    return {};
  }
  return replace_file(path, fmt::format("{}\n", fmt::join(events, "\n")));
}

}  // namespace plchost
