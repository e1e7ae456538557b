#include "instances/runtime/memory/save_left_behind.hpp"

#include <algorithm>

#include "instances/runtime/memory/retain_files.hpp"
#include "instances/runtime/memory/retain_memory.hpp"
#include "instances/runtime/settings/settings.hpp"
#include "shm/base/time.hpp"
#include "shm/log/log.hpp"

namespace plchost {

namespace {

Result<std::string> directory_of(const LaunchOptions& launch) {
  if (launch.settings.empty()) return launch.state_directory;
  PLCHOST_TRY_ASSIGN(const auto settings, read_settings(launch.settings));
  const std::string& own = settings.retain.directory;
  return own.empty() ? launch.state_directory : own;
}

}  // namespace

Result<void> save_left_behind(const LaunchOptions& launch) {
  auto left = RetainMemory::left_behind(launch.pool, retain_memory_name(launch.name));
  if (!left && left.error().code == ErrorCode::not_found) return {};
  // A damaged memory is worth nothing: the files hold the last good values.
  if (!left && left.error().code == ErrorCode::corrupt) {
    spdlog::warn("retain variables: the values that are left in memory are not written: {}",
                 left.error().describe());
    return {};
  }
  if (!left) return std::unexpected(left.error());
  PLCHOST_TRY_ASSIGN(const auto directory, directory_of(launch));
  if (directory.empty()) return failure(ErrorCode::not_found, "no folder for retain variables is given");
  PLCHOST_TRY_ASSIGN(auto files, RetainFiles::open(directory, launch.name));
  const auto found = files.read();
  RetainImage& image = left->image;
  if (found.newest) {
    const bool newer = found.newest->generation > image.generation;
    if (newer || (found.newest->layout == image.layout && found.newest->data == image.data)) return {};
  }
  if (left->in_cycle > 0) {
    spdlog::warn("retain variables: the process ended within the cycles of {} tasks", left->in_cycle);
  }
  ++image.generation;
  image.unix_ns = unix_time_ns();
  return files.write(image);
}

}  // namespace plchost
