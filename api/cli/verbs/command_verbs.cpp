// The verbs that ask a host or an instance for something, from the table of operations.
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "api/cli/cli_session.hpp"
#include "api/cli/verbs/application_verbs.hpp"
#include "api/cli/verbs/host_commands.hpp"
#include "shm/operations/operations.hpp"

namespace plchost {

namespace {

constexpr const char* kSeveral = "one or more; 'line*' stands for all that begin with line";

ApiRequest request_of(const Operation& operation, std::string instance, std::string argument) {
  return {"", static_cast<std::int32_t>(operation.verb), std::move(instance), std::move(argument)};
}

int ask(CliSession& session, const Operation& operation, const std::string& instance,
        const std::string& argument) {
  return command(session, request_of(operation, instance, argument), done_text(operation, argument));
}

/// `name`: "INSTANCE/EVENT" or the like; `may_be_all`: or "INSTANCE".
int ask_about_part(CliSession& session, const Operation& operation, const char* what, const std::string& name,
                   bool may_be_all) {
  if (may_be_all && name.find('/') == std::string::npos) return ask(session, operation, name, "");
  const auto parts = split_name(what, name);
  if (!parts) return CliSession::fail(parts.error());
  return ask(session, operation, parts->first, parts->second);
}

void add_for_instances(const Command& verb, CliSession& session, const Operation& operation) {
  const auto names = std::make_shared<std::vector<std::string>>();
  verb.noun(operation.noun_word, operation.help,
            [&session, &operation, names] {
              return command_each(session, *names, request_of(operation, "", ""), done_text(operation, ""));
            })
      .arguments("INSTANCE", *names, kSeveral);
}

void add_for_part(const Command& verb, CliSession& session, const Operation& operation) {
  const bool may_be_all = operation.argument == OperationArgument::task_or_none;
  const auto name = std::make_shared<std::string>();
  verb.noun(operation.noun_word, operation.help,
            [&session, &operation, name, may_be_all] {
              return ask_about_part(session, operation, may_be_all ? "TASK" : "EVENT", *name, may_be_all);
            })
      .argument(may_be_all ? "INSTANCE[/TASK]" : "INSTANCE/EVENT", *name);
}

void add_with_argument(const Command& verb, CliSession& session, const Operation& operation,
                       const char* form) {
  const auto instance = std::make_shared<std::string>();
  const auto argument = std::make_shared<std::string>();
  verb.noun(operation.noun_word, operation.help,
            [&session, &operation, instance, argument] {
              return ask(session, operation, *instance, *argument);
            })
      .argument("INSTANCE", *instance)
      .argument(form, *argument);
}

void add(const Command& plcctl, CliSession& session, const Operation& operation) {
  const bool own_help = *operation.verb_help != '\0';
  const Command verb = plcctl.verb(operation.verb_word, own_help ? operation.verb_help : operation.help);
  if (!operation.names_instance) {
    verb.noun(operation.noun_word, operation.help,
              [&session, &operation] { return ask(session, operation, "", ""); });
    return;
  }
  switch (operation.argument) {
    case OperationArgument::none:
      return add_for_instances(verb, session, operation);
    case OperationArgument::event:
    case OperationArgument::task_or_none:
      return add_for_part(verb, session, operation);
    case OperationArgument::scheduler:
      return add_with_argument(verb, session, operation, "SCHEDULER");
    case OperationArgument::path:
    case OperationArgument::file:
      return add_with_argument(verb, session, operation, "FILE");
    case OperationArgument::variable_or_all:
      return add_with_argument(verb, session, operation, "VARIABLE");
    case OperationArgument::variable_value:
      return add_with_argument(verb, session, operation, "ASSIGNMENT");
    case OperationArgument::debug_command:
      return;  // "plcctl debug"
  }
}

/// One noun for two operations.
void add_reset(const Command& plcctl, CliSession& session) {
  const auto names = std::make_shared<std::vector<std::string>>();
  const auto cold = std::make_shared<bool>(false);
  plcctl.verb("reset", "Begin anew: an instance, or its statistics")
      .noun("instance", operation_of(ControlVerb::reset).help,
            [&session, names, cold] {
              const Operation& reset = operation_of(*cold ? ControlVerb::reset_cold : ControlVerb::reset);
              return command_each(session, *names, request_of(reset, "", ""), done_text(reset, ""));
            })
      .arguments("INSTANCE", *names, kSeveral)
      .flag("--cold", *cold, "tell the application to begin with initial values");
}

}  // namespace

void add_command_verbs(const Command& plcctl, CliSession& session) {
  for (const Operation& operation : operations()) {
    if (*operation.verb_word != '\0') add(plcctl, session, operation);
    // These have more words than an argument, where their rows stand.
    if (operation.verb == ControlVerb::reset) add_reset(plcctl, session);
    if (operation.verb == ControlVerb::load_application) add_application_verbs(plcctl, session);
  }
}

}  // namespace plchost
