#include "api/cli/top/plant_look.hpp"

#include <algorithm>
#include <utility>

#include "api/client/client_core_status.hpp"
#include "api/dds/text.hpp"

namespace plchost {

void PlantLook::take(std::vector<HostView> hosts, TimePoint deadline) {
  std::vector<HostLook> before = std::exchange(hosts_, {});
  for (HostView& host : hosts) {
    const auto old =
        std::ranges::find(before, host.name, [](const HostLook& look) { return look.host.name; });
    HostLook look = old == before.end() ? HostLook{} : std::move(*old);
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
  const auto look = std::ranges::find(hosts_, host, [](const HostLook& one) { return one.host.name; });
  if (look == hosts_.end()) return found;
  for (const plc_TaskStatus& task : look->tasks) {
    if (dds::text_of(task.instance) != instance) continue;
    if (auto report = client_.statistics(host, instance, dds::text_of(task.task), MonotonicClock::now())) {
      found.tasks.push_back(*std::move(report));
    }
  }
  return found;
}

}  // namespace plchost
