#include <filesystem>
#include <memory>
#include <utility>

#include <CLI/CLI.hpp>
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

/// Sends a command to the host and says what became of it.
int command(CliSession& session, ApiRequest request) {
  auto host = session.target_host();
  if (!host) return CliSession::fail(host.error());
  request.host = std::move(*host);
  ControlClient& client = *session.client().value();
  const auto reply =
      client.call(request, session.deadline(takes_long(request.operation) ? kLongCommand : Duration::zero()));
  if (!reply) return CliSession::fail(reply.error());
  if (reply->code == ErrorCode::ok) {
    if (session.options.json) {
      fmt::print("{}", format_json({Row{{"host", request.host},
                                        {"instance", request.instance},
                                        {"done", true},
                                        {"remark", reply->text}}}));
    } else if (!reply->text.empty()) {
      fmt::print("{}\n", reply->text);
    }
    return kExitDone;
  }
  std::string text = reply->text;
  if (reply->code == ErrorCode::not_found) {
    std::vector<std::string> names;
    if (const auto all = client.instances(request.host, session.deadline())) {
      for (const auto& instance : *all) names.emplace_back(dds::text_of(instance.instance));
    }
    text += hint(request.instance, names);
  }
  fmt::print(stderr, "plcctl: {}\n", text);
  return kExitFailed;
}

int command_event(CliSession& session, std::int32_t operation, const std::string& name) {
  const auto parts = split_name("EVENT", name);
  if (!parts) return CliSession::fail(parts.error());
  return command(session, {"", operation, parts->first, parts->second});
}

/// A verb may have several nouns.
CLI::App* add_verb(CLI::App& app, const char* verb, const char* noun, const char* text) {
  const auto known = app.get_subcommands([verb](CLI::App* other) { return other->get_name() == verb; });
  CLI::App* const outer = known.empty() ? app.add_subcommand(verb, text) : known.front();
  outer->require_subcommand(1)->fallthrough();
  return outer->add_subcommand(noun, text)->fallthrough();
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

void add_plain(CLI::App& app, CliSession& session, Action& action, const char* verb, std::int32_t operation,
               const char* text) {
  const auto name = std::make_shared<std::string>();
  CLI::App* const noun = add_verb(app, verb, "instance", text);
  noun->add_option("INSTANCE", *name)->required();
  noun->callback([&session, &action, name, operation] {
    action = [&session, name, operation] { return command(session, {"", operation, *name, ""}); };
  });
}

void add_reset(CLI::App& app, CliSession& session, Action& action) {
  const auto name = std::make_shared<std::string>();
  const auto cold = std::make_shared<bool>(false);
  CLI::App* const noun =
      add_verb(app, "reset", "instance", "Load the application anew, in a fresh process, stopped");
  noun->add_option("INSTANCE", *name)->required();
  noun->add_flag("--cold", *cold, "tell the application to begin with initial values");
  noun->callback([&session, &action, name, cold] {
    action = [&session, name, cold] {
      return command(session, {"", *cold ? plc_OPERATION_RESET_COLD : plc_OPERATION_RESET, *name, ""});
    };
  });
}

void add_event(CLI::App& app, CliSession& session, Action& action, const char* verb, std::int32_t operation,
               const char* text) {
  const auto name = std::make_shared<std::string>();
  CLI::App* const noun = add_verb(app, verb, "event", text);
  noun->add_option("INSTANCE/EVENT", *name)->required();
  noun->callback([&session, &action, name, operation] {
    action = [&session, name, operation] { return command_event(session, operation, *name); };
  });
}

}  // namespace

void add_command_verbs(CLI::App& app, CliSession& session, Action& action) {
  add_plain(app, session, action, "start", plc_OPERATION_START, "Run the application of an instance");
  add_plain(app, session, action, "stop", plc_OPERATION_STOP, "Stop the application of an instance");
  add_plain(app, session, action, "single-cycle", plc_OPERATION_SINGLE_CYCLE,
            "Run one cycle of each cyclic and freewheeling task of a stopped application");
  add_reset(app, session, action);
  add_plain(app, session, action, "restart", plc_OPERATION_RESTART, "Load the application anew and run it");
  add_event(app, session, action, "register", plc_OPERATION_REGISTER_EVENT, "Register an external event");
  add_event(app, session, action, "unregister", plc_OPERATION_UNREGISTER_EVENT,
            "Unregister an external event");

  const auto name = std::make_shared<std::string>();
  CLI::App* const statistics =
      add_verb(app, "reset", "statistics", "Begin the statistics of a task, or of all of an instance, anew");
  statistics->add_option("INSTANCE[/TASK]", *name)->required();
  statistics->callback(
      [&session, &action, name] { action = [&session, name] { return reset_statistics(session, *name); }; });

  const auto instance = std::make_shared<std::string>();
  const auto argument = std::make_shared<std::string>();
  CLI::App* const load = add_verb(app, "load", "application", "Load another application into an instance");
  load->add_option("INSTANCE", *instance)->required();
  load->add_option("FILE", *argument, "the application; a relative path starts at the current directory")
      ->required();
  load->callback([&session, &action, instance, argument] {
    action = [&session, instance, argument] {
      const std::string path = std::filesystem::absolute(*argument).lexically_normal();
      return command(session, {"", plc_OPERATION_LOAD_APPLICATION, *instance, path});
    };
  });
  CLI::App* const set =
      add_verb(app, "set", "scheduler", "Choose the scheduler of an instance, also while it runs");
  set->add_option("INSTANCE", *instance)->required();
  set->add_option("SCHEDULER", *argument)->required();
  set->callback([&session, &action, instance, argument] {
    action = [&session, instance, argument] {
      return command(session, {"", plc_OPERATION_SET_SCHEDULER, *instance, *argument});
    };
  });
}

}  // namespace plchost
