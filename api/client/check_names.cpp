#include "api/client/check_names.hpp"

#include <fmt/format.h>

#include "shm/base/names.hpp"

namespace plchost {

namespace {

// The bounds of control.idl; its texts are terminated.
static_assert(sizeof(plc_EventPost::host) == kMaxHostName + 1);
static_assert(sizeof(plc_EventPost::instance) == kMaxInstanceName + 1);
static_assert(sizeof(plc_EventPost::event) == kMaxEventName + 1);
static_assert(sizeof(plc_RequestHeader::instance_name) == kMaxHostName + 1);
static_assert(sizeof(plc_Request::instance) == kMaxInstanceName + 1);
static_assert(sizeof(plc_Request::argument) == kMaxArgument + 1);

Result<void> check_instance_name(std::string_view instance) {
  return check_name("instance", instance, kMaxInstanceName);
}

}  // namespace

Result<void> check_host_name(std::string_view host) {
  return check_name("host", host, kMaxHostName);
}

Result<void> check_host_name(std::string_view host, std::string_view only) {
  if (auto good = check_host_name(host); !good || only.empty() || host == only) return good;
  return failure(
      ErrorCode::invalid_argument,
      fmt::format("this client is for host '{}' only, not for '{}': use one for that host, or for all", only,
                  host));
}

Result<void> check_event_name(std::string_view instance, std::string_view event) {
  PLCHOST_TRY(check_instance_name(instance));
  return check_name("event", event, kMaxEventName);
}

Result<void> check_task_name(std::string_view instance, std::string_view task) {
  PLCHOST_TRY(check_instance_name(instance));
  return check_name("task", task, kMaxTaskName);
}

Result<void> check_api_request(const ApiRequest& request, std::string_view only) {
  PLCHOST_TRY(check_host_name(request.host, only));
  if (!request.instance.empty()) {
    PLCHOST_TRY(check_instance_name(request.instance));
  }
  if (request.argument.size() <= kMaxArgument && !request.argument.contains('\0')) return {};
  return failure(ErrorCode::invalid_argument,
                 fmt::format("argument '{}' of {} bytes: allowed are up to {}, and no zero among them",
                             shown(request.argument), request.argument.size(), kMaxArgument));
}

Result<std::pair<std::string, std::string>> split_name(std::string_view what, std::string_view text) {
  const auto slash = text.find('/');
  if (slash == std::string_view::npos || slash == 0 || slash + 1 == text.size()) {
    return failure(ErrorCode::invalid_argument,
                   fmt::format("'{}' is not of the form INSTANCE/{}", text, what));
  }
  return std::pair{std::string(text.substr(0, slash)), std::string(text.substr(slash + 1))};
}

}  // namespace plchost
