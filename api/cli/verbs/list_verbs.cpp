#include <algorithm>
#include <functional>
#include <memory>
#include <type_traits>
#include <utility>

#include <fmt/format.h>

#include "api/cli/cli_session.hpp"
#include "api/cli/rows/rows.hpp"
#include "api/cli/rows/status_rows.hpp"
#include "api/cli/verbs/application_verbs.hpp"
#include "api/cli/verbs/host_commands.hpp"
#include "api/cli/verbs/host_verbs.hpp"
#include "api/cli/verbs/node_verbs.hpp"
#include "api/cli/verbs/object_verbs.hpp"
#include "api/cli/verbs/task_rows.hpp"
#include "api/cli/verbs/transition_verbs.hpp"
#include "api/cli/verbs/variable_recording.hpp"
#include "api/client/client_core_status.hpp"
#include "api/dds/text.hpp"

namespace plchost {

namespace {

int list_tasks(CliSession& session, const std::string& instance) {
  const auto rows = task_rows(session, instance);
  if (!rows) return CliSession::fail(rows.error());
  return session.show(*rows, columns_of<plc_TaskStatus>());
}

template <class Sample>
int list(
    CliSession& session,
    const std::function<bool(const Sample&)>& is_shown = [](const Sample&) { return true; }) {
  const auto hosts = session.shown_hosts();
  if (!hosts) return CliSession::fail(hosts.error());
  const auto client = session.client();
  if (!client) return CliSession::fail(client.error());
  std::vector<Row> rows;
  for (const HostView& host : *hosts) {
    const auto samples = (*client)->template status<Sample>(host.name, session.deadline());
    if (!samples) return CliSession::fail(samples.error());
    for (const Sample& sample : *samples) {
      if (is_shown(sample)) rows.push_back(to_row(sample));
    }
  }
  return session.show(rows, columns_of<Sample>());
}

/// A noun for each status topic that control.idl says `list:` of.
template <class... Samples>
struct ListedTopics {
  static void add(const Command& verb, CliSession& session) {
    const auto add_one = [&]<class Sample>(std::type_identity<Sample> /*type*/) {
      constexpr dds::Listing kHow = dds::kListing<Sample>;
      if constexpr (*kHow.noun != '\0') {
        verb.noun(kHow.noun, kHow.text, [&session] { return list<Sample>(session); });
      }
    };
    (add_one(std::type_identity<Samples>()), ...);
  }
  /// "events, writers, "
  static std::string nouns() {
    std::string nouns;
    for (const char* const noun : {dds::kListing<Samples>.noun...}) {
      if (*noun != '\0') nouns += fmt::format("{}, ", noun);
    }
    return nouns;
  }
};

int list_instances(CliSession& session, const std::vector<std::string>& names) {
  if (names.empty()) return list<plc_InstanceStatus>(session);
  const auto wanted = expand(session, names);
  if (!wanted) return CliSession::fail(wanted.error());
  for (const NamedInstance& one : *wanted) {
    if (!one.hosts.empty()) continue;
    if (const auto known = session.check_instance(one.name); !known) return CliSession::fail(known.error());
  }
  const std::function is_wanted = [&](const plc_InstanceStatus& sample) {
    return std::ranges::find(*wanted, dds::text_of(sample.instance), &NamedInstance::name) != wanted->end();
  };
  return list(session, is_wanted);
}

// Instances that never had one have nothing to show.
bool has_happened(const plc_ExceptionStatus& exception) {
  return exception.count > 0;
}

}  // namespace

void add_list_verbs(const Command& plcctl, CliSession& session) {
  const std::string text = fmt::format(
      "Show all hosts, instances, tasks, {}objects, nodes, variables, forces, exceptions, applications or "
      "transitions",
      dds::OfCountedStatus<ListedTopics>::nouns());
  const Command verb = plcctl.verb("list", text.c_str());
  add_list_hosts(verb, session);
  const auto names = std::make_shared<std::vector<std::string>>();
  verb.noun("instances", "The PLC instances", [&session, names] { return list_instances(session, *names); })
      .optional("INSTANCE", *names, "only these; 'line*' stands for all that begin with line");
  const auto instance = std::make_shared<std::string>();
  verb.noun("tasks", "The tasks of all applications, with their figures",
            [&session, instance] { return list_tasks(session, *instance); })
      .optional("INSTANCE", *instance, "only of this instance");
  dds::OfCountedStatus<ListedTopics>::add(verb, session);
  add_list_objects(verb, session);
  add_list_nodes(verb, session);
  add_list_variables(verb, session);
  verb.noun("exceptions", "The last exception of each instance that had any", [&session] {
    return list(session, std::function<bool(const plc_ExceptionStatus&)>(has_happened));
  });
  add_list_applications(verb, session);
  add_list_transitions(verb, session);
}

}  // namespace plchost
