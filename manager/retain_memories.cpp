#include "manager/retain_memories.hpp"

#include <algorithm>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <optional>
#include <utility>

#include <poll.h>

#include "instances/launch/launch_contract.hpp"
#include "manager/system/child_process.hpp"
#include "shm/base/time.hpp"
#include "shm/files/memory_file.hpp"
#include "shm/files/memory_rights.hpp"
#include "shm/files/pool_files.hpp"
#include "shm/log/log.hpp"

namespace plchost {

namespace {

// A disk may be slow; the service manager waits for 60 s in all.
constexpr Duration kSaveLimit = std::chrono::seconds(20);

/// One memory, and the process that writes what is in it.
struct Saving {
  std::string memory;
  Result<ChildProcess> process;
};

std::vector<std::string> retain_memories_of(const std::string& pool) {
  std::vector<std::string> memories;
  std::error_code error;
  for (std::filesystem::directory_iterator at(MemoryFile::kDirectory, error), end; !error && at != end;
       at.increment(error)) {
    auto memory = memory_of_file(pool, at->path().filename().string());
    if (memory && memory->ends_with(retain_memory_name(""))) memories.push_back(*std::move(memory));
  }
  return memories;
}

Result<ChildProcess> start_to_save(const ManagerConfig& config, const std::string& plc_instance,
                                   const InstanceConfig& instance) {
  LaunchOptions launch;
  launch.name = instance.name;
  launch.settings = instance.settings;
  launch.pool = config.host.pool;
  launch.state_directory = config.host.state_directory;
  launch.log_level = config.host.log_level;
  launch.user = config.host.instance_user;
  launch.trusted_users = users_of_instances();
  auto arguments = to_arguments(plc_instance, launch);
  arguments.emplace_back(kSaveRetainOption);
  return spawn_process({.arguments = std::move(arguments)});
}

Result<void> wait_until_saved(const ChildProcess& process, TimePoint deadline) {
  const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - MonotonicClock::now()).count();
  pollfd poll{.fd = process.pidfd.get(), .events = POLLIN, .revents = 0};
  const bool ended = ::poll(&poll, 1, static_cast<int>(std::max<std::int64_t>(left, 0))) == 1;
  if (!ended) {
    (void)signal_process(process, SIGKILL);
    return failure(ErrorCode::timed_out, "the disk did not take them in time");
  }
  const ExitStatus status = reap_process(process);
  if (status.success()) return {};
  return failure(ErrorCode::unavailable, "the process that was to write them: " + status.describe());
}

}  // namespace

std::vector<std::string> save_retain_memories(const ManagerConfig& config, const std::string& plc_instance) {
  std::vector<Saving> all;
  for (const std::string& memory : retain_memories_of(config.host.pool)) {
    const auto instance = std::ranges::find_if(
        config.instances, [&](const InstanceConfig& one) { return retain_memory_name(one.name) == memory; });
    all.push_back({.memory = memory,
                   .process = instance != config.instances.end()
                                  ? start_to_save(config, plc_instance, *instance)
                                  : failure(ErrorCode::not_found, "no such instance is configured")});
  }
  const TimePoint deadline = MonotonicClock::now() + kSaveLimit;
  std::vector<std::string> unsaved;
  for (const auto& [memory, process] : all) {
    const auto saved =
        and_then(process, [&](const auto& started) { return wait_until_saved(started, deadline); });
    if (saved) continue;
    spdlog::warn("the retain variables in memory '{}' are in no file and stay in {}: {}", memory,
                 MemoryFile::kDirectory, saved.error().describe());
    unsaved.push_back(memory);
  }
  return unsaved;
}

}  // namespace plchost
