#include "instances/runtime/tasks/operator_events.hpp"

#include <cerrno>
#include <filesystem>
#include <fstream>

#include <fmt/format.h>

#include "instances/runtime/tasks/event_table.hpp"
#include "shm/base/names.hpp"
#include "shm/files/replace_file.hpp"

namespace plchost {

std::string operator_events_path(std::string_view run_directory, std::string_view instance) {
  return fmt::format("{}/{}.events", run_directory, instance);
}

Result<std::vector<std::string>> read_operator_events(const std::string& path) {
  std::vector<std::string> events;
  errno = 0;
  std::ifstream file(path);
  if (!file && errno != ENOENT) return failure(ErrorCode::system, "open " + path, errno);
  for (std::string line; events.size() < EventTable::kMaxEvents && std::getline(file, line);) {
    if (check_name("event name", line, kMaxEventName)) events.push_back(std::move(line));
  }
  return events;
}

Result<void> write_operator_events(const std::string& path, const std::vector<std::string>& events) {
  std::error_code error;
  if (events.empty()) {
    std::filesystem::remove(path, error);
    if (error) return failure(ErrorCode::system, "remove " + path, error.value());
    return {};
  }
  return replace_file(path, fmt::format("{}\n", fmt::join(events, "\n")));
}

}  // namespace plchost
