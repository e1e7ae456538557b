#include "api/server/access/request_check.hpp"

#include <algorithm>
#include <map>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "api/control/application_order.hpp"
#include "api/dds/text.hpp"
#include "api/dds/topics.hpp"
#include "shm/base/names.hpp"
#include "shm/operations/operations.hpp"

namespace plchost {

namespace {

using Argument = OperationArgument;
using Options = OperationOptions;

std::string known_operations() {
  std::string list;
  for (const Operation& operation : operations()) {
    if (operation.place == OperationPlace::internal) continue;
    list +=
        fmt::format("{}{} {}", list.empty() ? "" : ", ", std::to_underlying(operation.verb), operation.name);
  }
  return list;
}

// The instance knows its variables and their types.
Result<void> check_variable_argument(const Operation& operation, std::string_view argument) {
  const bool has_value = operation.argument == Argument::variable_value;
  const std::size_t end = argument.find('=');
  const bool good = has_value ? end != std::string_view::npos && end > 0
                              : end == std::string_view::npos && !argument.empty();
  if (good && is_printable_utf8(argument)) return {};
  return failure(ErrorCode::invalid_argument,
                 fmt::format("{}: '{}' is not of the form {}", operation.name, shown(argument),
                             has_value ? "NAME=VALUE" : "NAME"));
}

// The instance knows its commands.
Result<void> check_debug_argument(const Operation& operation, std::string_view argument) {
  if (!argument.empty() && is_printable_utf8(argument)) return {};
  return failure(ErrorCode::invalid_argument,
                 fmt::format("{}: '{}' is not of the form COMMAND", operation.name, shown(argument)));
}

Result<void> check_argument(const Operation& operation, std::string_view argument) {
  switch (operation.argument) {
    case Argument::none:
      if (argument.empty()) return {};
      return failure(ErrorCode::invalid_argument, fmt::format("{} takes no argument", operation.name));
    case Argument::path:
      if (argument.starts_with('/') && argument.size() <= kMaxPath) return {};
      return failure(ErrorCode::invalid_argument,
                     fmt::format("application '{}' is not an absolute path on the host", shown(argument)));
    case Argument::file:
      return check_file_name(argument);
    case Argument::scheduler:
      return check_name("scheduler", argument, kMaxSchedulerName);
    case Argument::event:
      return check_name("event", argument, kMaxEventName);
    case Argument::task_or_none:
      return argument.empty() ? Result<void>() : check_name("task", argument, kMaxTaskName);
    case Argument::debug_command:
      return check_debug_argument(operation, argument);
    case Argument::variable_or_all:
    case Argument::variable_value:
      return check_variable_argument(operation, argument);
  }
  return {};
}

Result<void> check_instance(const Operation& operation, std::string_view instance, std::string_view host,
                            std::span<const std::string_view> instances) {
  if (!operation.names_instance) {
    if (instance.empty()) return {};
    return failure(ErrorCode::invalid_argument,
                   fmt::format("{} is for the whole host: name no instance", operation.name));
  }
  PLCHOST_TRY(check_name("instance", instance, kMaxInstanceName));
  if (std::ranges::find(instances, instance) != instances.end()) return {};
  return failure(ErrorCode::not_found, fmt::format("no instance '{}' on host '{}'; there are: {}", instance,
                                                   host, join_names(instances)));
}

using OptionValues = std::map<std::string, std::string>;

Result<OptionValues> check_options(const Operation& operation, const plc_Request& request) {
  const bool loads = operation.options != Options::none;
  const bool download = operation.options == Options::download;
  OptionValues options;
  if (request.boot) options.emplace(kBootOption, kYes);
  if (request.online) options.emplace(kOnlineOption, kYes);
  if (!loads && !options.empty()) {
    return failure(ErrorCode::invalid_argument,
                   fmt::format("{} takes no option '{}'", operation.name, options.begin()->first));
  }
  const std::string_view digest = dds::text_of(request.sha256);
  if (!download && (request.size != 0 || !digest.empty())) {
    return failure(ErrorCode::invalid_argument,
                   fmt::format("{} takes no '{}' and no '{}'", operation.name, kSizeOption, kDigestOption));
  }
  if (!download) return options;
  options.emplace(kSizeOption, fmt::format("{}", request.size));
  options.emplace(kDigestOption, digest);
  PLCHOST_TRY(ApplicationOrder::from_options(options));
  return options;
}

}  // namespace

Result<ControlRequest> check_request(const plc_Request& request, ApiRole role, std::string_view host,
                                     std::span<const std::string_view> instances) {
  const auto addressed = dds::text_of(request.header.instance_name);
  if (addressed != host) {
    return failure(ErrorCode::not_found, fmt::format("this is host '{}', not '{}'", host, shown(addressed)));
  }
  const Operation* const operation = find_operation(request.operation);
  if (operation == nullptr) {
    return failure(ErrorCode::unsupported, fmt::format("unknown operation {}; this host knows: {}",
                                                       request.operation, known_operations()));
  }
  if (operation->role != role) {
    return failure(ErrorCode::refused,
                   fmt::format("'{}' does not belong to the topic {}: write it to {}", operation->name,
                               request_topic(role).name, request_topic(operation->role).name));
  }
  const auto instance = dds::text_of(request.instance);
  PLCHOST_TRY(check_instance(*operation, instance, host, instances));
  const auto argument = dds::text_of(request.argument);
  PLCHOST_TRY(check_argument(*operation, argument));
  PLCHOST_TRY_ASSIGN(auto options, check_options(*operation, request));
  return ControlRequest{0, operation->verb, std::string(instance), std::string(argument), std::move(options)};
}

const dds::TopicInfo& request_topic(ApiRole role) noexcept {
  if (role == ApiRole::engineering) return dds::kEngineerRequest;
  return role == ApiRole::operating ? dds::kOperatorRequest : dds::kViewerRequest;
}

security::Role role_of(ApiRole role) noexcept {
  if (role == ApiRole::engineering) return security::Role::engineer;
  return role == ApiRole::operating ? security::Role::operating : security::Role::viewer;
}

bool only_reads(std::int32_t operation) noexcept {
  const Operation* const known = find_operation(operation);
  return known != nullptr && known->only_reads;
}

std::string operation_name(std::int32_t operation) {
  const Operation* const known = find_operation(operation);
  return known != nullptr ? std::string(known->name) : fmt::format("operation {}", operation);
}

std::int32_t remote_exception(ErrorCode code) noexcept {
  constexpr std::int32_t kOk = 0;
  constexpr std::int32_t kInvalidArgument = 2;
  constexpr std::int32_t kUnknownOperation = 5;
  if (code == ErrorCode::unsupported) return kUnknownOperation;
  return code == ErrorCode::invalid_argument ? kInvalidArgument : kOk;
}

}  // namespace plchost
