#include "api/cli/task_rows.hpp"

#include <algorithm>

#include "api/cli/rows.hpp"
#include "api/dds/text.hpp"

namespace plchost {

Result<std::vector<Row>> task_rows(CliSession& session, const std::string& instance) {
  const auto hosts = session.shown_hosts();
  if (!hosts) return std::unexpected(hosts.error());
  std::vector<Row> rows;
  std::vector<std::string> names;
  ControlClient& client = *session.client().value();
  for (const HostView& host : *hosts) {
    const auto tasks = client.tasks(host.name, session.deadline());
    if (!tasks) return std::unexpected(tasks.error());
    for (const auto& task : *tasks) {
      if (instance.empty() || dds::text_of(task.instance) == instance) rows.push_back(to_row(task));
    }
    if (instance.empty()) continue;
    const auto instances = client.instances(host.name, session.deadline());
    if (!instances) return std::unexpected(instances.error());
    for (const auto& known : *instances) names.emplace_back(dds::text_of(known.instance));
  }
  if (instance.empty() || std::ranges::find(names, instance) != names.end()) return rows;
  return unknown_name("instance", instance, names);
}

}  // namespace plchost
