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
  add_application_verbs(plcctl, session);
  add_set(plcctl, session);
}

}  // namespace plchost
