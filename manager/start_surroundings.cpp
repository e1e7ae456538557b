// start_surroundings(): with the network, and with trials of applications and settings.

#include <csignal>
#include <memory>
#include <string>
#include <utility>

#include <fmt/format.h>
#include <net/if.h>
#include <poll.h>
#include <unistd.h>

#include "manager/server_files.hpp"
#include "manager/surroundings.hpp"
#include "manager/system/application_trial.hpp"
#include "manager/system/child_process.hpp"
#include "shm/base/names.hpp"

namespace plchost {

namespace {

std::vector<std::string> network_interfaces() {
  const std::unique_ptr<struct if_nameindex, decltype(&::if_freenameindex)> all(::if_nameindex(),
                                                                                &::if_freenameindex);
  std::vector<std::string> names;
  // The last one has no name.
  for (const struct if_nameindex* at = all.get(); at != nullptr && at->if_name != nullptr; ++at) {
    names.emplace_back(at->if_name);
  }
  return names;
}

bool ends_within(int process, Duration limit) {
  pollfd end{.fd = process, .events = POLLIN, .revents = 0};
  const auto wait = std::chrono::duration_cast<std::chrono::milliseconds>(limit).count();
  return ::poll(&end, 1, static_cast<int>(wait)) == 1;
}

Result<void> try_application(const std::string& plc_instance, const HostConfig& host,
                             const InstanceConfig& instance) {
  LaunchOptions launch;
  launch.name = check_name("instance", instance.name, kMaxInstanceName) ? instance.name : "plc";
  launch.scheduler = instance.scheduler;
  launch.priority_band = instance.priority_band;
  launch.settings = instance.settings;
  launch.application = instance.application;
  launch.pool = host.pool;
  launch.state_directory = host.state_directory;
  launch.no_debug = !host.allow_debug;
  // Another user checks a file with the own rights.
  if (::geteuid() == 0) launch.user = host.instance_user;
  PLCHOST_TRY_ASSIGN(auto trial, ApplicationTrial::start(plc_instance, launch));
  trial.await_end();
  return trial.verdict();
}

Result<void> try_settings(const std::string& plc_instance, const std::string& file) {
  PLCHOST_TRY_ASSIGN(auto pipe, make_output_pipe());
  PLCHOST_TRY_ASSIGN(const auto process, spawn_process({.arguments = {plc_instance, "--check-settings", file},
                                                        .output_fd = pipe.write_end.get()}));
  if (!ends_within(process.pidfd.get(), kTrialLimit)) (void)signal_process(process, SIGKILL);
  (void)ends_within(process.pidfd.get(), kTrialLimit);
  const ExitStatus status = reap_process(process);
  if (status.success()) return {};
  constexpr std::size_t kShown = 2000;
  std::string text = read_available(pipe.read_end.get(), kShown);
  while (text.ends_with('\n')) text.pop_back();
  return failure(ErrorCode::invalid_argument, text.empty() ? status.describe() : text);
}

}  // namespace

ConfigSurroundings start_surroundings(const std::string& programs) {
  const std::string plc_instance = programs + "/plc-instance";
  ConfigSurroundings surroundings = config_surroundings();
  surroundings.check_directories = true;
  surroundings.check_state = [](const HostConfig& host) -> Result<void> {
    PLCHOST_TRY(check_state_folders(host));
    return check_state_is_kept(host);
  };
  surroundings.interfaces = network_interfaces();
  surroundings.check_application = [plc_instance](const HostConfig& host, const InstanceConfig& instance) {
    return try_application(plc_instance, host, instance);
  };
  surroundings.check_settings = [plc_instance](const std::string& file) {
    return try_settings(plc_instance, file);
  };
  return surroundings;
}

}  // namespace plchost
