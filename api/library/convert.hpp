#pragma once

#include <library_conversions.hpp>

#include "api/client/control_client.hpp"
#include "api/client/log_reader.hpp"
#include "api/plchost_client.hpp"

namespace plchost {

/// From what travels to what the library's users see, where library_conversions.hpp has it not. Any context.
[[nodiscard]] Client::Host to_public(const HostView& host, bool answers);
[[nodiscard]] Client::Transition to_public(const TransitionView& transition);
[[nodiscard]] Client::LogLine to_public(const LogText& line);
[[nodiscard]] Client::Outcome to_public(const PostReport& report);

/// Throws invalid_argument if there is none.
void check_callback(bool given);
[[noreturn]] void throw_client_error(const Error& error);

}  // namespace plchost
