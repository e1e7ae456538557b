#include <memory>
#include <sstream>
#include <string>
#include <tuple>

#include <fmt/format.h>

#include "api/cli/cli_session.hpp"
#include "api/cli/rows/rows.hpp"
#include "api/cli/rows/statistics_rows.hpp"
#include "api/cli/rows/status_rows.hpp"
#include "api/cli/terminal.hpp"
#include "api/cli/verbs/node_verbs.hpp"
#include "api/cli/verbs/object_verbs.hpp"
#include "api/client/client_core_status.hpp"
#include "api/dds/text.hpp"
#include "shm/base/names.hpp"

namespace plchost {

namespace {

int show_row(const CliSession& session, const Row& row) {
  if (session.options.csv) {
    fmt::print("{}", format_csv({row}));
  } else {
    fmt::print("{}", session.options.json ? format_json({row}) : format_fields(row));
  }
  return kExitDone;
}

template <class Sample>
std::string name_of(const Sample& sample) {
  return std::string(dds::text_of(sample.instance));
}
std::string name_of(const plc_TaskStatus& task) {
  return fmt::format("{}/{}", task.instance, task.task);
}

/// The sample of that name, of the host that is meant. not_found: lists the names that there are.
template <class Sample>
Result<Sample> find(CliSession& session, Snapshot<Sample> snapshot, std::string_view what,
                    const std::string& name) {
  PLCHOST_TRY_ASSIGN(const auto host, session.target_host());
  PLCHOST_TRY_ASSIGN(const auto all, (session.client().value()->*snapshot)(host, session.deadline()));
  std::vector<std::string> names;
  for (const Sample& sample : all) {
    names.push_back(name_of(sample));
    if (names.back() == name) return sample;
  }
  return unknown_name(what, name, names, host);
}

// No time as a number, and nothing where there is no process.
Row for_people(Row row) {
  row.erase("state_since_unix_ns");
  if (row.at("pid") == 0) row["pid"] = Row();
  if (row.at("core") == -1) row["core"] = Row();
  return row;
}

/// The number of the version that is loaded; null: it was not sent, but is another file of the host.
Result<Row> loaded_version(CliSession& session, const plc_InstanceStatus& instance) {
  const std::string host(dds::text_of(instance.host));
  PLCHOST_TRY_ASSIGN(const auto kept, session.client().value()->applications(host, session.deadline()));
  for (const plc_ApplicationStatus& application : kept) {
    const bool is_loaded = dds::text_of(application.instance) == dds::text_of(instance.instance) &&
                           dds::text_of(application.path) == dds::text_of(instance.loaded);
    if (is_loaded && application.version > 0) return Row(application.version);
  }
  return Row();
}

int show_instance(CliSession& session, const std::string& name) {
  const auto instance = find(session, &ControlClient::instances, "instance", name);
  if (!instance) return CliSession::fail(instance.error());
  const auto version = loaded_version(session, *instance);
  if (!version) return CliSession::fail(version.error());
  Row row = to_row(*instance);
  row["loaded_version"] = *version;
  if (session.options.json || session.options.csv) return show_row(session, row);
  fmt::print("{}", format_fields(for_people(row)));
  return kExitDone;
}

int show_statistics(CliSession& session, const plc_TaskStatus& task) {
  const std::string host(dds::text_of(task.host));
  const auto report = session.client().value()->statistics(host, dds::text_of(task.instance),
                                                           dds::text_of(task.task), session.deadline());
  if (!report) return CliSession::fail(report.error());
  Row row = to_row(task);
  if (session.options.json) {
    add_statistics(row, report->sample());
    return show_row(session, row);
  }
  // The fields that the statistics tell in more detail are left to them.
  Row identity;
  for (const char* field :
       {"host", "instance", "task", "kind", "priority", "interval_us", "state", "external_event"}) {
    identity[field] = row[field];
  }
  fmt::print("{}{}", format_fields(identity), format_statistics(report->sample(), terminal_style()));
  if (report->sample().lost_cycles > 0) {
    fmt::print("\nwhy cycles were lost: plcctl show losses {}\n", name_of(task));
  }
  return kExitDone;
}

int show_task(CliSession& session, const std::string& name) {
  const auto parts = split_name("TASK", name);
  if (!parts) return CliSession::fail(parts.error());
  const auto task = find(session, &ControlClient::tasks, "task", name);
  return task ? show_statistics(session, *task) : CliSession::fail(task.error());
}

/// Of INSTANCE or INSTANCE/TASK, the oldest first.
Result<std::vector<Row>> loss_rows(CliSession& session, const std::string& name) {
  std::string instance = name;
  std::string task;
  if (name.contains('/')) {
    PLCHOST_TRY_ASSIGN(std::tie(instance, task), split_name("TASK", name));
    PLCHOST_TRY(find(session, &ControlClient::tasks, "task", name));
  } else {
    PLCHOST_TRY(session.check_instance(instance));
  }
  PLCHOST_TRY_ASSIGN(const auto host, session.target_host());
  PLCHOST_TRY_ASSIGN(const auto losses,
                     session.client().value()->status<plc_LossStatus>(host, session.deadline()));
  std::vector<Row> rows;
  for (const plc_LossStatus& loss : losses) {
    if (dds::text_of(loss.instance) != instance) continue;
    if (task.empty() || dds::text_of(loss.task) == task) rows.push_back(to_row(loss));
  }
  return rows;
}

int show_losses(CliSession& session, const std::string& name) {
  const auto rows = loss_rows(session, name);
  if (!rows) return CliSession::fail(rows.error());
  if (!rows->empty() || session.options.json || session.options.csv) {
    return session.show(*rows, columns_of<plc_LossStatus>());
  }
  fmt::print("{} has lost no cycles\n", name);
  return kExitDone;
}

// The functions of a back-trace, each on a line with its number.
std::string format_back_trace(const std::string& functions) {
  std::string text;
  std::istringstream lines(functions);
  std::string function;
  for (int number = 0; std::getline(lines, function); ++number) {
    text += fmt::format("  #{:<2} {}\n", number, printable(function));
  }
  return text.empty() ? text : "back_trace\n" + text;
}

std::string format_activity(const std::string& entries) {
  std::string text;
  std::istringstream lines(entries);
  for (std::string entry; std::getline(lines, entry);) text += fmt::format("  {}\n", printable(entry));
  return text.empty() ? text : "activity\n" + text;
}

// For people: no field that says nothing, addresses as tools print them.
std::string format_exception(Row row) {
  for (const char* field : {"address", "memory_address"}) {
    const auto address = row[field].get<std::uint64_t>();
    row[field] = address != 0 ? fmt::format("{:#x}", address) : "";
  }
  row.erase("time_unix_ns");
  constexpr double kUsPerSecond = 1e6;
  if (row["uptime_us"].is_number())
    row["uptime"] = fmt::format("{:.1f} s", row["uptime_us"].get<double>() / kUsPerSecond);
  row.erase("uptime_us");
  if (row["settings"].get_ref<const std::string&>().empty()) row.erase("cycles");
  const Row end = row["back_trace_end"];  // beside the back-trace
  row.erase("back_trace_end");
  row["back_trace_end"] = end;
  const auto back_trace = row["back_trace"].get<std::string>();
  row.erase("back_trace");
  const auto activity = row["activity"].get<std::string>();
  row.erase("activity");
  Row said;
  for (const auto& [field, value] : row.items()) {
    if (!value.is_string() || !value.get_ref<const std::string&>().empty()) said[field] = value;
  }
  return format_fields(said) + format_back_trace(back_trace) + format_activity(activity);
}

int show_exception(CliSession& session, const std::string& name) {
  const auto exception = find(session, &ControlClient::exceptions, "instance", name);
  if (!exception) return CliSession::fail(exception.error());
  const Row row = to_row(*exception);
  if (session.options.json) return show_row(session, row);
  fmt::print("{}", exception->count > 0 ? format_exception(row)
                                        : fmt::format("instance '{}' has had no exception\n", name));
  return kExitDone;
}

}  // namespace

void add_show_verbs(const Command& plcctl, CliSession& session) {
  const Command verb = plcctl.verb("show",
                                   "Show all that is known of one instance, its last exception or lost "
                                   "cycles, one task or one object, or how "
                                   "blocks go");
  const auto add = [&](const char* noun, const char* form, const char* text,
                       int (*run)(CliSession&, const std::string&)) {
    const auto name = std::make_shared<std::string>();
    verb.noun(noun, text, [&session, name, run] { return run(session, *name); }).argument(form, *name);
  };
  add("instance", "INSTANCE", "One PLC instance", show_instance);
  add("exception", "INSTANCE", "The last exception of one PLC instance", show_exception);
  add("task", "INSTANCE/TASK", "One task", show_task);
  add("losses", "INSTANCE[/TASK]", "The last lost cycles of one PLC instance or task, and why they were lost",
      show_losses);
  add_show_object(verb, session);
  add_show_routes(verb, session);
}

}  // namespace plchost
