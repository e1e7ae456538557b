#include <algorithm>
#include <filesystem>
#include <memory>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "api/cli/cli_session.hpp"
#include "api/dds/text.hpp"

namespace plchost {

namespace {

// A stop may take 35 s, and a fresh process comes after one. Longer than the server waits for the manager, so
// that its answer is heard.
constexpr Duration kLongCommand = std::chrono::seconds(80);

bool takes_long(std::int32_t operation) {
  switch (operation) {
    case plc_OPERATION_STOP:
    case plc_OPERATION_SINGLE_CYCLE:
    case plc_OPERATION_RESET:
    case plc_OPERATION_RESET_COLD:
    case plc_OPERATION_RESTART:
    case plc_OPERATION_LOAD_APPLICATION:
      return true;
    default:
      return false;
  }
}

// What a refusal does not say itself: the instance that was meant.
std::string advice(CliSession& session, const HostOutcome& outcome, const std::string& instance) {
  if (outcome.reply->code != ErrorCode::not_found) return "";
  std::vector<std::string> names;
  if (const auto all = session.client().value()->instances(outcome.host, session.deadline())) {
    for (const auto& known : *all) names.emplace_back(dds::text_of(known.instance));
  }
  return hint(instance, names);
}

/// Says what became of it at one of `count` hosts; its exit code.
int tell(CliSession& session, const HostOutcome& outcome, const std::string& instance, std::size_t count) {
  const std::string where = count > 1 ? outcome.host + ": " : "";
  if (!outcome.reply) {
    Error error = outcome.reply.error();
    error.message = where + error.message;
    return CliSession::fail(error);
  }
  if (outcome.reply->code != ErrorCode::ok) {
    fmt::print(stderr, "plcctl: {}{}{}\n", where, outcome.reply->text, advice(session, outcome, instance));
    return kExitFailed;
  }
  if (session.options.json || session.options.csv) return kExitDone;
  if (count > 1 || !outcome.reply->text.empty()) {
    fmt::print("{}{}\n", where, outcome.reply->text.empty() ? "done" : outcome.reply->text);
  }
  return kExitDone;
}

Row row_of(const HostOutcome& outcome, const std::string& instance) {
  const bool done = outcome.reply && outcome.reply->code == ErrorCode::ok;
  return {{"host", outcome.host},
          {"instance", instance},
          {"done", done},
          {"remark", outcome.reply ? outcome.reply->text : outcome.reply.error().describe()}};
}

/// Sends a command to the hosts that are meant and says what became of it.
int command(CliSession& session, const ApiRequest& request) {
  const auto hosts = session.target_hosts();
  if (!hosts) return CliSession::fail(hosts.error());
  const TimePoint deadline =
      session.deadline(takes_long(request.operation) ? kLongCommand : Duration::zero());
  std::vector<HostOutcome> outcomes;
  if (hosts->size() == 1) {  // over the connection that is there
    ApiRequest own = request;
    own.host = hosts->front();
    outcomes.push_back({.host = own.host, .reply = session.client().value()->call(own, deadline)});
  } else {
    outcomes = call_each(session.options.dds, *hosts, request, deadline);
  }
  int code = kExitDone;
  std::vector<Row> done;
  for (const HostOutcome& outcome : outcomes) {
    code = std::max(code, tell(session, outcome, request.instance, outcomes.size()));
    if (outcomes.size() > 1 || code == kExitDone) done.push_back(row_of(outcome, request.instance));
  }
  if ((session.options.json || session.options.csv) && !done.empty()) session.show(done, {});
  return code;
}

int command_event(CliSession& session, std::int32_t operation, const std::string& name) {
  const auto parts = split_name("EVENT", name);
  if (!parts) return CliSession::fail(parts.error());
  return command(session, {"", operation, parts->first, parts->second});
}

/// "INSTANCE/TASK", or "INSTANCE" for all of its tasks.
int reset_statistics(CliSession& session, const std::string& name) {
  if (name.find('/') == std::string::npos) {
    return command(session, {"", plc_OPERATION_RESET_STATISTICS, name, ""});
  }
  const auto parts = split_name("TASK", name);
  if (!parts) return CliSession::fail(parts.error());
  return command(session, {"", plc_OPERATION_RESET_STATISTICS, parts->first, parts->second});
}

void add_plain(const Command& plcctl, CliSession& session, const char* verb, std::int32_t operation,
               const char* text) {
  const auto name = std::make_shared<std::string>();
  plcctl.verb(verb, text)
      .noun("instance", text,
            [&session, name, operation] { return command(session, {"", operation, *name, ""}); })
      .argument("INSTANCE", *name);
}

void add_reset(const Command& plcctl, CliSession& session) {
  const Command verb = plcctl.verb("reset", "Begin anew: an instance, or its statistics");
  const auto name = std::make_shared<std::string>();
  const auto cold = std::make_shared<bool>(false);
  verb.noun("instance", "Load the application anew, in a fresh process, stopped",
            [&session, name, cold] {
              return command(session,
                             {"", *cold ? plc_OPERATION_RESET_COLD : plc_OPERATION_RESET, *name, ""});
            })
      .argument("INSTANCE", *name)
      .flag("--cold", *cold, "tell the application to begin with initial values");
  verb.noun("statistics", "Begin the statistics of a task, or of all of an instance, anew",
            [&session, name] { return reset_statistics(session, *name); })
      .argument("INSTANCE[/TASK]", *name);
}

void add_event(const Command& plcctl, CliSession& session, const char* verb, std::int32_t operation,
               const char* text) {
  const auto name = std::make_shared<std::string>();
  plcctl.verb(verb, text)
      .noun("event", text, [&session, name, operation] { return command_event(session, operation, *name); })
      .argument("INSTANCE/EVENT", *name);
}

void add_load(const Command& plcctl, CliSession& session) {
  const auto instance = std::make_shared<std::string>();
  const auto file = std::make_shared<std::string>();
  const char* const text = "Load another application into an instance";
  plcctl.verb("load", text)
      .noun("application", text,
            [&session, instance, file] {
              const std::string path = std::filesystem::absolute(*file).lexically_normal();
              return command(session, {"", plc_OPERATION_LOAD_APPLICATION, *instance, path});
            })
      .argument("INSTANCE", *instance)
      .argument("FILE", *file, "the application; a relative path starts at the current directory");
}

void add_set(const Command& plcctl, CliSession& session) {
  const auto instance = std::make_shared<std::string>();
  const auto scheduler = std::make_shared<std::string>();
  const char* const text = "Choose the scheduler of an instance, also while it runs";
  plcctl.verb("set", text)
      .noun("scheduler", text,
            [&session, instance, scheduler] {
              return command(session, {"", plc_OPERATION_SET_SCHEDULER, *instance, *scheduler});
            })
      .argument("INSTANCE", *instance)
      .argument("SCHEDULER", *scheduler);
}

}  // namespace

void add_command_verbs(const Command& plcctl, CliSession& session) {
  add_plain(plcctl, session, "start", plc_OPERATION_START, "Run the application of an instance");
  add_plain(plcctl, session, "stop", plc_OPERATION_STOP, "Stop the application of an instance");
  add_plain(plcctl, session, "single-cycle", plc_OPERATION_SINGLE_CYCLE,
            "Run one cycle of each cyclic and freewheeling task of a stopped application");
  add_reset(plcctl, session);
  add_plain(plcctl, session, "restart", plc_OPERATION_RESTART, "Load the application anew and run it");
  add_event(plcctl, session, "register", plc_OPERATION_REGISTER_EVENT, "Register an external event");
  add_event(plcctl, session, "unregister", plc_OPERATION_UNREGISTER_EVENT, "Unregister an external event");
  add_load(plcctl, session);
  add_set(plcctl, session);
}

}  // namespace plchost
