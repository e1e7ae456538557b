#include "api/server/access/request_check.hpp"

#include <algorithm>
#include <array>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "api/control/application_order.hpp"
#include "api/dds/entries.hpp"
#include "api/dds/text.hpp"
#include "shm/base/names.hpp"

namespace plchost {

namespace {

enum class Argument : std::uint8_t { none, path, file, scheduler, event, task_or_none };
/// What `ext` may say beside the argument.
enum class Options : std::uint8_t { none, loading, download };

struct Operation {
  std::int32_t number;
  ControlVerb verb;
  ApiRole role;
  Argument argument;
  bool of_host = false;  // names no instance
  Options options = Options::none;
};

constexpr std::array kOperations = {
    Operation{plc_OPERATION_START, ControlVerb::start, ApiRole::operating, Argument::none},
    Operation{plc_OPERATION_STOP, ControlVerb::stop, ApiRole::operating, Argument::none},
    Operation{plc_OPERATION_RESET, ControlVerb::reset, ApiRole::operating, Argument::none},
    Operation{plc_OPERATION_RESET_COLD, ControlVerb::reset_cold, ApiRole::operating, Argument::none},
    Operation{plc_OPERATION_SINGLE_CYCLE, ControlVerb::single_cycle, ApiRole::operating, Argument::none},
    Operation{plc_OPERATION_RESTART, ControlVerb::restart, ApiRole::operating, Argument::none},
    Operation{plc_OPERATION_RESET_STATISTICS, ControlVerb::reset_statistics, ApiRole::operating,
              Argument::task_or_none},
    Operation{plc_OPERATION_CHECK_HOST, ControlVerb::check_host, ApiRole::operating, Argument::none,
              /*of_host=*/true},
    Operation{plc_OPERATION_LIST_OBJECTS, ControlVerb::list_objects, ApiRole::operating, Argument::none,
              /*of_host=*/true},
    Operation{plc_OPERATION_LIST_NODES, ControlVerb::list_nodes, ApiRole::operating, Argument::none,
              /*of_host=*/true},
    Operation{plc_OPERATION_LIST_ROUTES, ControlVerb::list_routes, ApiRole::operating, Argument::none,
              /*of_host=*/true},
    Operation{plc_OPERATION_READ_CLOCK, ControlVerb::read_clock, ApiRole::operating, Argument::none,
              /*of_host=*/true},
    Operation{plc_OPERATION_READ_LOG, ControlVerb::read_log, ApiRole::operating, Argument::none},
    Operation{plc_OPERATION_LOAD_APPLICATION, ControlVerb::load_application, ApiRole::engineering,
              Argument::path, /*of_host=*/false, Options::loading},
    Operation{plc_OPERATION_DOWNLOAD_APPLICATION, ControlVerb::download_application, ApiRole::engineering,
              Argument::file, /*of_host=*/false, Options::download},
    Operation{plc_OPERATION_ROLLBACK_APPLICATION, ControlVerb::rollback_application, ApiRole::engineering,
              Argument::none, /*of_host=*/false, Options::loading},
    Operation{plc_OPERATION_RELOAD_HOST, ControlVerb::reload_host, ApiRole::engineering, Argument::none,
              /*of_host=*/true},
    Operation{plc_OPERATION_SET_SCHEDULER, ControlVerb::set_scheduler, ApiRole::engineering,
              Argument::scheduler},
    Operation{plc_OPERATION_REGISTER_EVENT, ControlVerb::register_event, ApiRole::engineering,
              Argument::event},
    Operation{plc_OPERATION_UNREGISTER_EVENT, ControlVerb::unregister_event, ApiRole::engineering,
              Argument::event},
};

std::string known_operations() {
  std::string list;
  for (const Operation& operation : kOperations) {
    list += fmt::format("{}{} {}", list.empty() ? "" : ", ", operation.number, to_string(operation.verb));
  }
  return list;
}

Result<void> check_argument(const Operation& operation, std::string_view argument) {
  switch (operation.argument) {
    case Argument::none:
      if (argument.empty()) return {};
      return failure(ErrorCode::invalid_argument,
                     fmt::format("{} takes no argument", to_string(operation.verb)));
    case Argument::path:
      if (argument.starts_with('/') && argument.size() <= kMaxPath) return {};
      return failure(ErrorCode::invalid_argument,
                     fmt::format("application '{}' is not an absolute path on the host", shown(argument)));
    case Argument::file:
      return check_file_name(argument);
    case Argument::scheduler:
      return check_name("scheduler", argument, 31);
    case Argument::event:
      return check_name("event", argument, kMaxEventName);
    case Argument::task_or_none:
      return argument.empty() ? Result<void>() : check_name("task", argument, kMaxTaskName);
  }
  return {};
}

Result<void> check_instance(const Operation& operation, std::string_view instance, std::string_view host,
                            std::span<const std::string_view> instances) {
  if (operation.of_host) {
    if (instance.empty()) return {};
    return failure(ErrorCode::invalid_argument,
                   fmt::format("{} is for the whole host: name no instance", to_string(operation.verb)));
  }
  if (auto good = check_name("instance", instance, kMaxInstanceName); !good) return good;
  if (std::ranges::find(instances, instance) != instances.end()) return {};
  return failure(ErrorCode::not_found, fmt::format("no instance '{}' on host '{}'; there are: {}", instance,
                                                   host, join_names(instances)));
}

using OptionValues = std::map<std::string, std::string>;

Result<OptionValues> check_options(const Operation& operation, std::span<const plc_KeyValue> ext) {
  OptionValues options;
  if (operation.options == Options::none) return options;
  std::string boot;
  std::string online;
  std::string size;
  std::string digest;
  const bool download = operation.options == Options::download;
  std::vector<std::pair<std::string_view, std::string*>> known{{kBootOption, &boot},
                                                               {kOnlineOption, &online}};
  if (download) known.insert(known.end(), {{kSizeOption, &size}, {kDigestOption, &digest}});
  if (const auto read = dds::read_entries(ext, known); !read) return std::unexpected(read.error());
  for (const auto& [name, value] : std::span(known).first(2)) {
    if (value->empty() || *value == kYes) continue;
    return failure(ErrorCode::invalid_argument,
                   fmt::format("'{}' is '{}'; only '{}' is allowed", name, shown(*value), kYes));
  }
  for (const auto& [name, value] : known) {
    if (!value->empty()) options.emplace(name, *value);
  }
  if (!download) return options;
  if (const auto order = ApplicationOrder::from_options(options); !order)
    return std::unexpected(order.error());
  return options;
}

}  // namespace

Result<ControlRequest> check_request(const plc_Request& request, ApiRole role, std::string_view host,
                                     std::span<const std::string_view> instances) {
  const auto addressed = dds::text_of(request.header.instance_name);
  if (addressed != host) {
    return failure(ErrorCode::not_found, fmt::format("this is host '{}', not '{}'", host, shown(addressed)));
  }
  const auto* const operation = std::ranges::find(kOperations, request.operation, &Operation::number);
  if (operation == kOperations.end()) {
    return failure(ErrorCode::unsupported, fmt::format("unknown operation {}; this host knows: {}",
                                                       request.operation, known_operations()));
  }
  if (operation->role != role) {
    return failure(
        ErrorCode::refused,
        fmt::format("'{}' is not for the {} role: write it to the other request topic",
                    to_string(operation->verb), role == ApiRole::operating ? "operator" : "engineer"));
  }
  const auto instance = dds::text_of(request.instance);
  if (auto good = check_instance(*operation, instance, host, instances); !good)
    return std::unexpected(good.error());
  const auto argument = dds::text_of(request.argument);
  if (auto good = check_argument(*operation, argument); !good) return std::unexpected(good.error());
  auto ext = check_options(*operation, std::span(request.ext._buffer, request.ext._length));
  if (!ext) return std::unexpected(std::move(ext).error());
  return ControlRequest{0, operation->verb, std::string(instance), std::string(argument), *std::move(ext)};
}

bool only_reads(std::int32_t operation) noexcept {
  return operation == plc_OPERATION_CHECK_HOST || operation == plc_OPERATION_LIST_OBJECTS ||
         operation == plc_OPERATION_LIST_NODES || operation == plc_OPERATION_LIST_ROUTES ||
         operation == plc_OPERATION_READ_CLOCK || operation == plc_OPERATION_READ_LOG;
}

std::string operation_name(std::int32_t operation) {
  const auto* const known = std::ranges::find(kOperations, operation, &Operation::number);
  return known != kOperations.end() ? std::string(to_string(known->verb))
                                    : fmt::format("operation {}", operation);
}

std::int32_t remote_exception(ErrorCode code) noexcept {
  constexpr std::int32_t kOk = 0;
  constexpr std::int32_t kInvalidArgument = 2;
  constexpr std::int32_t kUnknownOperation = 5;
  if (code == ErrorCode::unsupported) return kUnknownOperation;
  return code == ErrorCode::invalid_argument ? kInvalidArgument : kOk;
}

}  // namespace plchost
