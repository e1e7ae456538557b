// The verbs for variables of an application.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <memory>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "api/cli/cli_session.hpp"
#include "api/cli/interrupt.hpp"
#include "api/cli/output.hpp"
#include "api/cli/rows/variable_rows.hpp"
#include "api/cli/verbs/host_commands.hpp"
#include "api/cli/verbs/trace_recording.hpp"
#include "api/cli/verbs/variable_changes.hpp"
#include "api/cli/verbs/variable_recording.hpp"
#include "api/cli/verbs/variable_sampler.hpp"
#include "api/dds/text.hpp"
#include "shm/base/names.hpp"
#include "shm/operations/operations.hpp"

namespace plchost {

namespace {

struct VariableArguments {
  std::string instance;
  std::vector<std::string> names;
};

struct WatchVariablesArguments {
  VariableArguments which;
  double interval_s = 0.5;
  std::uint64_t count = 0;  // 0: until Ctrl-C
};

VariableOwner owner_of(const VariableSampler& sampler) {
  return {.host = sampler.host(), .instance = sampler.instance()};
}

Result<VariableSampler> sampler_of(CliSession& session, const VariableArguments& arguments,
                                   bool forced = false) {
  PLCHOST_TRY_ASSIGN(auto host, session.target_host());
  return VariableSampler(session, std::move(host), arguments.instance,
                         {.patterns = arguments.names, .forced = forced, .after = 0});
}

// Programs are told the fields as control.idl has them.
int show_variables(const CliSession& session, const VariableSampler& sampler,
                   const std::vector<ListedVariable>& variables, std::vector<Column> columns) {
  std::vector<Row> rows;
  for (const plc_VariableRecord& variable : variables) rows.push_back(to_row(variable, owner_of(sampler)));
  if (!session.options.json && !session.options.csv) mark_forced_arrays(rows);
  return session.show(std::move(rows), std::move(columns));
}

int list_variables(CliSession& session, const VariableArguments& arguments) {
  auto sampler = sampler_of(session, arguments);
  if (!sampler) return CliSession::fail(sampler.error());
  const auto variables = sampler->all();
  if (!variables) return CliSession::fail(variables.error());
  return show_variables(session, *sampler, *variables, columns_of<plc_VariableRecord>());
}

const std::vector<Column>& value_columns() {
  static const std::vector<Column> columns{{.field = "name", .header = "NAME"},
                                           {.field = "value", .header = "VALUE"},
                                           {.field = "forced_value", .header = "FORCED", .rank = 1}};
  return columns;
}

void tell_torn(const CliSession& session) {
  if (session.options.quiet) return;
  fmt::print(stderr, "plcctl: a task was within a cycle: these values may be of different cycles\n");
}

int read_variables(CliSession& session, const VariableArguments& arguments) {
  auto sampler = sampler_of(session, arguments);
  if (!sampler) return CliSession::fail(sampler.error());
  const auto sample = sampler->sample();
  if (!sample) return CliSession::fail(sample.error());
  if (!sample->consistent) tell_torn(session);
  return show_variables(session, *sampler, sample->variables, value_columns());
}

/// One request for each, in their order; the first that fails ends it.
int command_for_each(CliSession& session, ControlVerb verb, const VariableArguments& arguments) {
  const Operation& operation = operation_of(verb);
  int code = kExitDone;
  for (const std::string& argument : arguments.names) {
    code = command(session, {"", static_cast<std::int32_t>(verb), arguments.instance, argument},
                   done_text(operation, argument));
    if (code != kExitDone) break;
  }
  return code;
}

void add_assignment(const Command& plcctl, CliSession& session, ControlVerb verb, const char* word) {
  const char* const text = operation_of(verb).help;
  const auto arguments = std::make_shared<VariableArguments>();
  plcctl.verb(word, text)
      .noun("variable", text,
            [&session, verb, arguments] { return command_for_each(session, verb, *arguments); })
      .argument("INSTANCE", arguments->instance)
      .arguments("ASSIGNMENT", arguments->names,
                 "VARIABLE=VALUE, the value as Structured Text writes it, as 5, TRUE, T#1s or 'text'");
}

struct UnforceArguments {
  VariableArguments which;
  bool all = false;
};

int unforce(CliSession& session, UnforceArguments arguments) {
  if (arguments.all == !arguments.which.names.empty()) {
    return CliSession::fail(
        {ErrorCode::invalid_argument, 0, "name the variables that are to be forced no longer, or say --all"});
  }
  constexpr std::string_view kAllForced = "*";  // to the instance
  std::vector<std::string>& names = arguments.which.names;
  if (std::ranges::find(names, kAllForced) != names.end()) {
    return CliSession::fail(
        {ErrorCode::invalid_argument, 0, "'*' is no variable; --all ends the forcing of all"});
  }
  if (arguments.all) names.emplace_back(kAllForced);
  return command_for_each(session, ControlVerb::unforce_variable, arguments.which);
}

int list_forces(CliSession& session, const std::string& instance) {
  const auto hosts = session.shown_hosts();
  if (!hosts) return CliSession::fail(hosts.error());
  std::vector<Row> rows;
  bool known = instance.empty();
  for (const HostView& host : *hosts) {
    const auto instances = session.client().value()->instances(host.name, session.deadline());
    if (!instances) return CliSession::fail(instances.error());
    for (const plc_InstanceStatus& each : *instances) {
      const std::string name(dds::text_of(each.instance));
      if (!instance.empty() && name != instance) continue;
      known = true;
      if (each.forces == 0) continue;
      VariableSampler sampler(session, host.name, name, {.patterns = {}, .forced = true, .after = 0});
      const auto forced = sampler.all();
      if (!forced) return CliSession::fail(forced.error());
      for (const plc_VariableRecord& variable : *forced)
        rows.push_back(to_row(variable, VariableOwner{host.name, name}));
    }
  }
  if (!known) return CliSession::fail(session.check_instance(instance).error());
  static const std::vector<Column> columns{{.field = "host", .header = "HOST", .rank = 1},
                                           {.field = "instance", .header = "INSTANCE"},
                                           {.field = "name", .header = "NAME"},
                                           {.field = "type", .header = "TYPE", .rank = 2},
                                           {.field = "forced_value", .header = "FORCED"},
                                           {.field = "value", .header = "VALUE"}};
  return session.show(std::move(rows), columns);
}

void print_change(const CliSession& session, const VariableSampler& sampler, const VariableListing& sample,
                  const plc_VariableRecord& variable) {
  if (session.options.json) {
    Row row{{"time", time_text(sample.time_unix_ns)},
            {"time_unix_ns", sample.time_unix_ns},
            {"consistent", sample.consistent}};
    row.update(to_row(variable, owner_of(sampler)));
    fmt::print("{}\n", json_text(row));
    return;
  }
  const std::string_view forced = forced_text(variable);
  fmt::print("{}  {}  {}{}{}\n", time_text(sample.time_unix_ns),
             printable(std::string(dds::text_of(variable.name))),
             printable(std::string(dds::text_of(variable.value))), forced.empty() ? "" : "  ", forced);
}

int watch_variables(CliSession& session, const WatchVariablesArguments& arguments) {
  catch_interrupts();
  auto sampler = sampler_of(session, arguments.which);
  if (!sampler) return CliSession::fail(sampler.error());
  VariableChanges changes;
  std::uint64_t lines = 0;
  const SampleTimes times{.interval = of_seconds(arguments.interval_s)};
  return sample_until_interrupted(*sampler, times, [&](const VariableListing& sample) {
    const auto found = changes.look(sample);
    if (found.is_first_torn) tell_torn(session);
    for (const std::string& name : found.gone)
      fmt::print(stderr, "plcctl: the application declares '{}' no longer\n", shown(name));
    for (const plc_VariableRecord* const variable : found.changed) {
      print_change(session, *sampler, sample, *variable);
      if (++lines == arguments.count) return false;
    }
    flush_output();
    return true;
  });
}

}  // namespace

void add_list_variables(const Command& verb, CliSession& session) {
  const auto arguments = std::make_shared<VariableArguments>();
  verb.noun("variables", "The variables that an application declares, with their values",
            [&session, arguments] { return list_variables(session, *arguments); })
      .argument("INSTANCE", arguments->instance)
      .optional("VARIABLE", arguments->names, kVariableNames);
  const auto instance = std::make_shared<std::string>();
  verb.noun("forces", "The values of variables that are forced",
            [&session, instance] { return list_forces(session, *instance); })
      .optional("INSTANCE", *instance, "only of this instance");
}

void add_watch_variables(const Command& verb, CliSession& session) {
  const auto arguments = std::make_shared<WatchVariablesArguments>();
  verb.noun("variables",
            "Variables: a line (with --json an object) for each change that a look finds, until Ctrl-C",
            [&session, arguments] { return watch_variables(session, *arguments); })
      .argument("INSTANCE", arguments->which.instance)
      .arguments("VARIABLE", arguments->which.names, kVariableNames)
      .option("--interval", arguments->interval_s, "seconds between two looks (default 0.5)",
              kMinSampleSeconds, kMaxSampleSeconds)
      .option("--count", arguments->count, "end after so many lines", std::uint64_t{0}, kMaxCount);
}

void add_variable_verbs(const Command& plcctl, CliSession& session) {
  const auto arguments = std::make_shared<VariableArguments>();
  plcctl.verb("read", "Read variables of an application")
      .noun("variable", "The values of variables, of one moment in which no task is within a cycle",
            [&session, arguments] { return read_variables(session, *arguments); })
      .argument("INSTANCE", arguments->instance)
      .arguments("VARIABLE", arguments->names, kVariableNames);
  add_assignment(plcctl, session, ControlVerb::write_variable, "write");
  add_assignment(plcctl, session, ControlVerb::force_variable, "force");
  const auto unforced = std::make_shared<UnforceArguments>();
  const char* const unforce_text = operation_of(ControlVerb::unforce_variable).help;
  plcctl.verb("unforce", unforce_text)
      .noun("variable", unforce_text, [&session, unforced] { return unforce(session, *unforced); })
      .argument("INSTANCE", unforced->which.instance)
      .optional("VARIABLE", unforced->which.names, "their names")
      .flag("--all", unforced->all, "all forced variables of the instance");
  add_record_variables(plcctl, session);
  add_record_trace(plcctl, session);
}

}  // namespace plchost
