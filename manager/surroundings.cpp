#include "manager/surroundings.hpp"

#include <array>
#include <climits>
#include <string>

#include <unistd.h>

#include "manager/host_check/host_files.hpp"
#include "schedulers/policies/registry.hpp"
#include "shm/threads/thread.hpp"

namespace plchost {

ConfigSurroundings config_surroundings() {
  ConfigSurroundings surroundings;
  std::array<char, HOST_NAME_MAX + 1> name{};
  if (::gethostname(name.data(), name.size() - 1) == 0) surroundings.host_name = name.data();
  surroundings.online_cores = online_cores().value_or(std::vector<int>{0});
  surroundings.isolated_cores =
      HostFiles().cores("/sys/devices/system/cpu/isolated").value_or(std::vector<int>());
  surroundings.schedulers.assign(kSchedulerNames.begin(), kSchedulerNames.end());
  return surroundings;
}

}  // namespace plchost
