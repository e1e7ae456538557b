#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <ctime>
#include <memory>
#include <string>
#include <vector>

#include <fmt/chrono.h>
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
  return fmt::format("{:%Y-%m-%dT%H:%M:%S}", fmt::gmtime(std::time(nullptr)));
}

/// A plant, and why not all of it was exported: a role may not read variables, or an instance does not
/// answer.
struct Export {
  plcopen::ExportedPlant plant;
  std::vector<Error> problems;
};

/// Those that the application of an instance declares: none, if it has no application, or does not tell them.
std::vector<ListedVariable> variables_of(CliSession& session, const std::string& host,
                                         const std::string& instance, std::vector<Error>& problems) {
  auto variables = VariableSampler(session, host, instance, {}).all();
  if (variables) return *std::move(variables);
  Error error = std::move(variables).error();
  if (error.code == ErrorCode::not_found) return {};
  error.message = fmt::format("{}: exported without its variables: {}", instance, error.message);
  problems.push_back(std::move(error));
  return {};
}

/// Of the instances of a host that are wanted: empty: all of them.
Result<ExportedHost> host_of(CliSession& session, const std::string& host,
                             const std::vector<std::string>& wanted, std::vector<Error>& problems) {
  ExportedHost exported{.name = host, .instances = {}};
  PLCHOST_TRY_ASSIGN(auto* const client, session.client());
  PLCHOST_TRY_ASSIGN(const auto instances, client->instances(host, session.deadline()));
  PLCHOST_TRY_ASSIGN(const auto tasks, client->tasks(host, session.deadline()));
  for (const plc_InstanceStatus& instance : instances) {
    const std::string name(dds::text_of(instance.instance));
    if (!wanted.empty() && std::ranges::find(wanted, name) == wanted.end()) continue;
    exported.instances.push_back(exported_instance(name, tasks, variables_of(session, host, name, problems)));
  }
  return exported;
}

Result<Export> plant_of(CliSession& session, const std::vector<std::string>& names,
                        const std::string& version) {
  Export result{.plant = {.product_version = version, .time = time_now(), .hosts = {}}, .problems = {}};
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
    PLCHOST_TRY_ASSIGN(auto exported, host_of(session, host.name, wanted, result.problems));
    if (wanted.empty() || !exported.instances.empty()) result.plant.hosts.push_back(std::move(exported));
  }
  return result;
}

int export_plant(CliSession& session, const std::vector<std::string>& names, const std::string& version) {
  const auto exported = plant_of(session, names, version);
  if (!exported) return CliSession::fail(exported.error());
  const std::string xml = plcopen::project_of(exported->plant);
  if (std::fwrite(xml.data(), 1, xml.size(), stdout) != xml.size() || std::fflush(stdout) != 0)
    return CliSession::fail(failure(ErrorCode::system, "cannot write the plant", errno).error());
  fmt::print(stderr, "{}\n", plcopen::kNotExported);
  int code = kExitDone;
  for (const Error& problem : exported->problems) code = CliSession::fail(problem);
  return code;
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
