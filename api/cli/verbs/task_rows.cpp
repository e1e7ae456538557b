#include "api/cli/verbs/task_rows.hpp"

#include "api/cli/rows/rows.hpp"
#include "api/cli/rows/status_rows.hpp"
#include "api/dds/text.hpp"

namespace plchost {

Result<std::vector<Row>> task_rows(CliSession& session, const std::string& instance) {
  PLCHOST_TRY_ASSIGN(const auto hosts, session.shown_hosts());
  std::vector<Row> rows;
  ControlClient& client = *session.client().value();
  for (const HostView& host : hosts) {
    PLCHOST_TRY_ASSIGN(const auto tasks, client.tasks(host.name, session.deadline()));
    for (const auto& task : tasks) {
      if (instance.empty() || dds::text_of(task.instance) == instance) rows.push_back(to_row(task));
    }
  }
  if (instance.empty()) return rows;
  PLCHOST_TRY(session.check_instance(instance));
  return rows;
}

}  // namespace plchost
