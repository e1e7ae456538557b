#include "api/cli/top/plant_look.hpp"

#include <algorithm>
#include <utility>

#include "api/client/client_core_status.hpp"
#include "api/dds/text.hpp"

namespace plchost {

const HostLook* find_host(const std::vector<HostLook>& hosts, std::string_view name) noexcept {
  const auto found =
      std::ranges::find_if(hosts, [&](const HostLook& look) { return look.host.name == name; });
  return found == hosts.end() ? nullptr : &*found;
}

void PlantLook::take(std::vector<HostView> hosts, TimePoint deadline) {
  const std::vector<HostLook> before = std::exchange(hosts_, {});
  for (HostView& host : hosts) {
    const HostLook* const old = find_host(before, host.name);
    HostLook look = old == nullptr ? HostLook{} : *old;
    look.host = std::move(host);
    const auto refresh = [&]<class Sample>(std::vector<Sample>& samples) {
      if (auto status = client_.status<Sample>(look.host.name, deadline)) samples = *std::move(status);
    };
    refresh(look.instances);
    refresh(look.tasks);
    refresh(look.losses);
    refresh(look.exceptions);
    hosts_.push_back(std::move(look));
  }
}

InstanceStatistics PlantLook::statistics(const std::string& host, const std::string& instance) {
  InstanceStatistics found{.host = host, .instance = instance, .tasks = {}};
  const HostLook* const look = find_host(hosts_, host);
  if (look == nullptr) return found;
  for (const plc_TaskStatus& task : look->tasks) {
    if (dds::text_of(task.instance) != instance) continue;
    if (auto report = client_.statistics(host, instance, dds::text_of(task.task), MonotonicClock::now())) {
      found.tasks.push_back(*std::move(report));
    }
  }
  return found;
}

}  // namespace plchost
