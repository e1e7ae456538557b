#include <algorithm>
#include <memory>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "api/cli/cli_session.hpp"
#include "api/cli/verbs/application_verbs.hpp"
#include "api/cli/verbs/host_commands.hpp"
#include "api/dds/text.hpp"

namespace plchost {

namespace {

int command_event(CliSession& session, std::int32_t operation, const std::string& name) {
  const auto parts = split_name("EVENT", name);
  if (!parts) return CliSession::fail(parts.error());
  return command(session, {"", operation, parts->first, parts->second},
                 fmt::format("event {} is {}", parts->second,
                             operation == plc_OPERATION_REGISTER_EVENT ? "registered" : "unregistered"));
}

/// "INSTANCE/TASK", or "INSTANCE" for all of its tasks.
int reset_statistics(CliSession& session, const std::string& name) {
  constexpr std::string_view kStatistics = "its statistics begin anew";
  if (name.find('/') == std::string::npos) {
    return command(session, {"", plc_OPERATION_RESET_STATISTICS, name, ""}, kStatistics);
  }
  const auto parts = split_name("TASK", name);
  if (!parts) return CliSession::fail(parts.error());
  return command(session, {"", plc_OPERATION_RESET_STATISTICS, parts->first, parts->second}, kStatistics);
}

struct Plain {
  const char* verb;
  std::int32_t operation;
  const char* text;
  const char* done;  ///< what is said of the instance then
};

constexpr const char* kSeveral = "one or more; 'line*' stands for all that begin with line";

void add_plain(const Command& plcctl, CliSession& session, const Plain& plain) {
  const auto names = std::make_shared<std::vector<std::string>>();
  plcctl.verb(plain.verb, plain.text)
      .noun("instance", plain.text,
            [&session, names, plain] {
              return command_each(session, *names, {"", plain.operation, "", ""}, plain.done);
            })
      .arguments("INSTANCE", *names, kSeveral);
}

void add_reset(const Command& plcctl, CliSession& session) {
  const Command verb = plcctl.verb("reset", "Begin anew: an instance, or its statistics");
  const auto name = std::make_shared<std::string>();
  const auto names = std::make_shared<std::vector<std::string>>();
  const auto cold = std::make_shared<bool>(false);
  verb.noun("instance", "Load the application anew, in a fresh process, stopped",
            [&session, names, cold] {
              const auto operation = *cold ? plc_OPERATION_RESET_COLD : plc_OPERATION_RESET;
              return command_each(session, *names, {"", operation, "", ""}, "reset, and stopped");
            })
      .arguments("INSTANCE", *names, kSeveral)
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

void add_reload(const Command& plcctl, CliSession& session) {
  plcctl.verb("reload", "Have a host read its configuration file again")
      .noun("host",
            "Take over the changes of the configuration file; says of each changed key when it is used. "
            "Unchanged instances run on",
            [&session] { return command(session, {"", plc_OPERATION_RELOAD_HOST, "", ""}, "reloaded"); });
}

void add_set(const Command& plcctl, CliSession& session) {
  const auto instance = std::make_shared<std::string>();
  const auto scheduler = std::make_shared<std::string>();
  const char* const text = "Choose the scheduler of an instance, also while it runs";
  plcctl.verb("set", text)
      .noun("scheduler", text,
            [&session, instance, scheduler] {
              return command(session, {"", plc_OPERATION_SET_SCHEDULER, *instance, *scheduler},
                             fmt::format("runs under {}", *scheduler));
            })
      .argument("INSTANCE", *instance)
      .argument("SCHEDULER", *scheduler);
}

}  // namespace

void add_command_verbs(const Command& plcctl, CliSession& session) {
  add_plain(plcctl, session, {"start", plc_OPERATION_START, "Run the application of an instance", "started"});
  add_plain(plcctl, session, {"stop", plc_OPERATION_STOP, "Stop the application of an instance", "stopped"});
  add_plain(
      plcctl, session,
      {"single-cycle", plc_OPERATION_SINGLE_CYCLE,
       "Run one cycle of each cyclic and freewheeling task of a stopped application", "has run one cycle"});
  add_reset(plcctl, session);
  add_plain(plcctl, session,
            {"restart", plc_OPERATION_RESTART, "Load the application anew and run it", "restarted"});
  add_event(plcctl, session, "register", plc_OPERATION_REGISTER_EVENT, "Register an external event");
  add_event(plcctl, session, "unregister", plc_OPERATION_UNREGISTER_EVENT, "Unregister an external event");
  add_application_verbs(plcctl, session);
  add_reload(plcctl, session);
  add_set(plcctl, session);
}

}  // namespace plchost
