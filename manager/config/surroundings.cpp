#include <array>
#include <climits>
#include <fstream>
#include <string>

#include <unistd.h>

#include "instances/launch/scheduler_choices.hpp"
#include "manager/config/load_config.hpp"
#include "shm/base/thread.hpp"

namespace plchost {

namespace {

// "1-2,4"; the file is there and empty if the kernel isolates none.
std::vector<int> isolated_cores() {
  std::ifstream file("/sys/devices/system/cpu/isolated");
  std::vector<int> cores;
  int first = 0;
  while (file >> first) {
    int last = first;
    if (file.peek() == '-') {
      file.ignore();
      file >> last;
    }
    for (int core = first; core <= last; ++core) cores.push_back(core);
    if (file.peek() == ',') file.ignore();
  }
  return cores;
}

}  // namespace

ConfigSurroundings config_surroundings() {
  ConfigSurroundings surroundings;
  std::array<char, HOST_NAME_MAX + 1> name{};
  if (::gethostname(name.data(), name.size() - 1) == 0) surroundings.host_name = name.data();
  surroundings.online_cores = online_cores().value_or(std::vector<int>{0});
  surroundings.isolated_cores = isolated_cores();
  surroundings.schedulers = scheduler_choices();
  return surroundings;
}

}  // namespace plchost
