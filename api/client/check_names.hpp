#pragma once

#include <string>
#include <string_view>
#include <utility>

#include "api/client/client_types.hpp"
#include "shm/base/result.hpp"

namespace plchost {

/// The names that a client gets from its user are checked before they go into a sample of control.idl. A name
/// that does not fit there would be cut, and mean another thing. invalid_argument: the text says what is
/// allowed. Any context.
[[nodiscard]] Result<void> check_host_name(std::string_view host);
/// The same, by a client for one host (`only`; empty: for all): another one is refused, too.
[[nodiscard]] Result<void> check_host_name(std::string_view host, std::string_view only);
[[nodiscard]] Result<void> check_event_name(std::string_view instance, std::string_view event);
[[nodiscard]] Result<void> check_task_name(std::string_view instance, std::string_view task);
/// No instance: a request for the whole host. The meaning of the argument is the host's business.
[[nodiscard]] Result<void> check_api_request(const ApiRequest& request, std::string_view only = {});

/// "I/T" split at the first slash. invalid_argument: no slash, or nothing on one side of it.
[[nodiscard]] Result<std::pair<std::string, std::string>> split_name(std::string_view what,
                                                                     std::string_view text);

}  // namespace plchost
