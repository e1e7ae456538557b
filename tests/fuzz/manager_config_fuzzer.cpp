#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "manager/config/load_config.hpp"
#include "shm/pages/host_page.hpp"

// Any text is either refused with at least one error that begins with the file's name, or accepted. Then the
// configuration keeps the bounds that the rest of the manager relies on.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace plchost;
  const ConfigSurroundings surroundings{.host_name = "host",
                                        .online_cores = {0, 1, 2, 3},
                                        .isolated_cores = {3},
                                        .schedulers = {"CmpSchedule", "CmpScheduleTimer"},
                                        .check_files = false};
  const auto config =
      parse_config({reinterpret_cast<const char*>(data), size}, "/etc/fuzz.toml", surroundings);
  if (!config) {
    if (config.error().empty()) std::abort();
    for (const auto& error : config.error()) {
      if (!error.starts_with("/etc/fuzz.toml:")) std::abort();
    }
    return 0;
  }
  if (config->instances.size() > kMaxInstances || config->host.run_directory.size() > kMaxRunDirectory)
    std::abort();
  for (const InstanceConfig& instance : config->instances) {
    const bool bounded = !instance.name.empty() && instance.name.size() <= kMaxInstanceName &&
                         instance.core >= 0 && instance.core <= 3 &&
                         instance.application.size() <= kMaxPath &&
                         instance.restart_delay <= instance.restart_delay_max;
    if (!bounded) std::abort();
  }
  return 0;
}
