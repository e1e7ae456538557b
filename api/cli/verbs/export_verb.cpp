#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <ctime>
#include <memory>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "api/cli/cli_session.hpp"
#include "api/cli/verbs/exported_instance.hpp"
#include "api/cli/verbs/host_commands.hpp"
#include "api/cli/verbs/variable_sampler.hpp"
#include "api/dds/text.hpp"
#include "instances/adapters/plcopen/write_project.hpp"

namespace plchost {

namespace {

using plcopen::ExportedHost;

std::string time_now() {
  const std::time_t now = std::chrono::system_clock::to_time_t(std::chrono::system_clock::now());
  std::tm parts{};
  ::gmtime_r(&now, &parts);
  return fmt::format("{:04}-{:02}-{:02}T{:02}:{:02}:{:02}", parts.tm_year + 1900, parts.tm_mon + 1,
                     parts.tm_mday, parts.tm_hour, parts.tm_min, parts.tm_sec);
}

/// Those that the application of an instance declares: none, if it has no application.
Result<std::vector<plc_VariableRecord>> variables_of(CliSession& session, const std::string& host,
                                                     const std::string& instance) {
  auto variables = VariableSampler(session, host, instance, {}).all();
  if (variables || variables.error().code != ErrorCode::not_found) return variables;
  return std::vector<plc_VariableRecord>();
}

/// Of the instances of a host that are wanted: empty: all of them.
Result<ExportedHost> host_of(CliSession& session, const std::string& host,
                             const std::vector<std::string>& wanted) {
  ExportedHost exported{.name = host, .instances = {}};
  PLCHOST_TRY_ASSIGN(auto* const client, session.client());
  PLCHOST_TRY_ASSIGN(const auto instances, client->instances(host, session.deadline()));
  PLCHOST_TRY_ASSIGN(const auto tasks, client->tasks(host, session.deadline()));
  for (const plc_InstanceStatus& instance : instances) {
    const std::string name(dds::text_of(instance.instance));
    if (!wanted.empty() && std::ranges::find(wanted, name) == wanted.end()) continue;
    PLCHOST_TRY_ASSIGN(const auto variables, variables_of(session, host, name));
    exported.instances.push_back(exported_instance(name, tasks, variables));
  }
  return exported;
}

Result<plcopen::ExportedPlant> plant_of(CliSession& session, const std::vector<std::string>& names,
                                        const std::string& version) {
  plcopen::ExportedPlant plant{.product_version = version, .time = time_now(), .hosts = {}};
  std::vector<std::string> wanted;
  if (!names.empty()) {
    PLCHOST_TRY_ASSIGN(const auto instances, expand(session, names));
    for (const NamedInstance& one : instances) {
      PLCHOST_TRY(session.check_instance(one.name));
      wanted.push_back(one.name);
    }
  }
  PLCHOST_TRY_ASSIGN(const auto hosts, session.shown_hosts());
  for (const HostView& host : hosts) {
    PLCHOST_TRY_ASSIGN(auto exported, host_of(session, host.name, wanted));
    if (wanted.empty() || !exported.instances.empty()) plant.hosts.push_back(std::move(exported));
  }
  return plant;
}

int export_plant(CliSession& session, const std::vector<std::string>& names, const std::string& version) {
  const auto plant = plant_of(session, names, version);
  if (!plant) return CliSession::fail(plant.error());
  const std::string xml = plcopen::project_of(*plant);
  if (std::fwrite(xml.data(), 1, xml.size(), stdout) == xml.size() && std::fflush(stdout) == 0)
    return kExitDone;
  return CliSession::fail(failure(ErrorCode::system, "cannot write the plant", errno).error());
}

}  // namespace

void add_export_verb(const Command& plcctl, CliSession& session, const std::string& version) {
  const auto names = std::make_shared<std::vector<std::string>>();
  plcctl.verb("export", "Write what runs as a file of another tool")
      .noun("plant",
            "Write tasks, programs and variables of the instances as PLCopen TC6 XML: a configuration for "
            "each host, a resource for each instance",
            [&session, names, version] { return export_plant(session, *names, version); })
      .optional("INSTANCE", *names, "only these; 'line*' stands for all that begin with line");
}

}  // namespace plchost
