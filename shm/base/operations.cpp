#include "shm/base/operations.hpp"

#include <algorithm>

#include <fmt/format.h>

namespace plchost {

namespace {

using Place = OperationPlace;
using Argument = OperationArgument;
constexpr ApiRole kEngineer = ApiRole::engineering;

constexpr std::array kOperations = {
    Operation{.verb = ControlVerb::start,
              .name = "start",
              .verb_word = "start",
              .noun_word = "instance",
              .help = "Run the application of an instance",
              .done = "started"},
    Operation{.verb = ControlVerb::stop,
              .name = "stop",
              .takes_long = true,
              .verb_word = "stop",
              .noun_word = "instance",
              .help = "Stop the application of an instance",
              .done = "stopped"},
    Operation{.verb = ControlVerb::single_cycle,
              .name = "single cycle",
              .place = Place::instance,
              .takes_long = true,
              .verb_word = "single-cycle",
              .noun_word = "instance",
              .help = "Run one cycle of each cyclic and freewheeling task of a stopped application",
              .done = "has run one cycle"},
    // plcctl has one noun for both: --cold.
    Operation{.verb = ControlVerb::reset, .name = "reset", .takes_long = true, .done = "reset, and stopped"},
    Operation{.verb = ControlVerb::reset_cold,
              .name = "reset cold",
              .takes_long = true,
              .done = "reset, and stopped"},
    Operation{.verb = ControlVerb::reset_statistics,
              .name = "reset statistics",
              .place = Place::instance,
              .argument = Argument::task_or_none,
              .verb_word = "reset",
              .noun_word = "statistics",
              .help = "Begin the statistics of a task, or of all of an instance, anew",
              .done = "its statistics begin anew"},
    Operation{.verb = ControlVerb::restart,
              .name = "restart",
              .takes_long = true,
              .verb_word = "restart",
              .noun_word = "instance",
              .help = "Load the application anew and run it",
              .done = "restarted"},
    Operation{.verb = ControlVerb::register_event,
              .name = "register event",
              .place = Place::instance,
              .role = kEngineer,
              .argument = Argument::event,
              .verb_word = "register",
              .noun_word = "event",
              .help = "Register an external event",
              .done = "event {} is registered"},
    Operation{.verb = ControlVerb::unregister_event,
              .name = "unregister event",
              .place = Place::instance,
              .role = kEngineer,
              .argument = Argument::event,
              .verb_word = "unregister",
              .noun_word = "event",
              .help = "Unregister an external event",
              .done = "event {} is unregistered"},
    Operation{.verb = ControlVerb::load_application,
              .name = "load application",
              .role = kEngineer,
              .argument = Argument::path,
              .options = OperationOptions::loading,
              .takes_long = true,
              .done = "{} is loaded"},
    Operation{.verb = ControlVerb::download_application,
              .name = "download application",
              .role = kEngineer,
              .argument = Argument::file,
              .options = OperationOptions::download,
              .takes_long = true,
              .done = "{} is loaded"},
    Operation{.verb = ControlVerb::rollback_application,
              .name = "rollback application",
              .role = kEngineer,
              .options = OperationOptions::loading,
              .takes_long = true,
              .done = "the predecessor is loaded"},
    Operation{
        .verb = ControlVerb::reload_host,
        .name = "reload host",
        .place = Place::host,
        .role = kEngineer,
        .names_instance = false,
        .takes_long = true,
        .verb_word = "reload",
        .noun_word = "host",
        .help = "Take over the changes of the configuration file; says of each changed key when it is used. "
                "Unchanged instances run on",
        .verb_help = "Have a host read its configuration file again",
        .done = "reloaded"},
    Operation{.verb = ControlVerb::set_scheduler,
              .name = "set scheduler",
              .place = Place::instance,
              .role = kEngineer,
              .argument = Argument::scheduler,
              .verb_word = "set",
              .noun_word = "scheduler",
              .help = "Choose the scheduler of an instance, also while it runs",
              .done = "runs under {}"},
    Operation{.verb = ControlVerb::check_host,
              .name = "check host",
              .place = Place::host,
              .names_instance = false,
              .only_reads = true},
    Operation{.verb = ControlVerb::list_objects,
              .name = "list objects",
              .place = Place::server,
              .names_instance = false,
              .only_reads = true},
    Operation{.verb = ControlVerb::list_nodes,
              .name = "list nodes",
              .place = Place::server,
              .names_instance = false,
              .only_reads = true},
    Operation{.verb = ControlVerb::list_routes,
              .name = "list routes",
              .place = Place::server,
              .names_instance = false,
              .only_reads = true},
    Operation{.verb = ControlVerb::read_clock,
              .name = "read clock",
              .place = Place::server,
              .names_instance = false,
              .only_reads = true},
    Operation{.verb = ControlVerb::read_log, .name = "read log", .place = Place::server, .only_reads = true},
    Operation{
        .verb = ControlVerb::change_application, .name = "change application", .place = Place::internal},
    Operation{.verb = ControlVerb::shutdown, .name = "shutdown", .place = Place::internal},
    Operation{.verb = ControlVerb::status, .name = "status", .place = Place::internal},
    Operation{.verb = ControlVerb::set_log_level, .name = "set log level", .place = Place::internal},
};

constexpr Operation kNone{.verb = ControlVerb{}, .name = "?", .place = Place::internal};

}  // namespace

std::span<const Operation> operations() noexcept {
  return kOperations;
}

const Operation& operation_of(ControlVerb verb) noexcept {
  const auto* const found = std::ranges::find(kOperations, verb, &Operation::verb);
  return found != kOperations.end() ? *found : kNone;
}

const Operation* find_operation(std::int32_t number) noexcept {
  const auto* const found = std::ranges::find_if(kOperations, [number](const Operation& operation) {
    return static_cast<std::int32_t>(operation.verb) == number && operation.place != Place::internal;
  });
  return found != kOperations.end() ? found : nullptr;
}

const Operation* find_operation(std::string_view name) noexcept {
  const auto* const found = std::ranges::find(kOperations, name, &Operation::name);
  return found != kOperations.end() && found->place != Place::internal ? found : nullptr;
}

std::string_view to_string(ControlVerb verb) noexcept {
  return operation_of(verb).name;
}

std::string done_text(const Operation& operation, std::string_view argument) {
  return fmt::format(fmt::runtime(operation.done), argument);
}

}  // namespace plchost
