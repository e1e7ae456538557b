#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "api/cli/plant/plant_file.hpp"
#include "shm/base/names.hpp"

// Any text is either refused with at least one error that begins with the file's name, or gives a plant that
// keeps the bounds of what goes into samples.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace plchost;
  const auto plant = parse_plant({reinterpret_cast<const char*>(data), size}, "/etc/plant.toml");
  if (!plant) {
    if (plant.error().empty()) std::abort();
    for (const auto& error : plant.error()) {
      if (!error.starts_with("/etc/plant.toml:")) std::abort();
    }
    return 0;
  }
  if (plant->hosts.empty() || plant->hosts.size() > kMaxPlantHosts) std::abort();
  for (const WantedHost& host : plant->hosts) {
    if (host.name.empty() || host.name.size() > kMaxHostName || host.instances.size() > kMaxHostInstances)
      std::abort();
    for (const WantedInstance& instance : host.instances) {
      const bool bounded = !instance.name.empty() && instance.name.size() <= kMaxInstanceName &&
                           instance.application.size() <= kMaxPath &&
                           instance.events.size() <= kMaxInstanceEvents;
      if (!bounded) std::abort();
    }
  }
  return 0;
}
