#pragma once

#include "api/client/control_client.hpp"
#include "api/client/log_reader.hpp"
#include "api/plchost_client.hpp"

namespace plchost {

/// From what travels to what the library's users see. Any context.
[[nodiscard]] Client::Host to_public(const HostView& host, bool answers);
[[nodiscard]] Client::Instance to_public(const plc_InstanceStatus& status);
[[nodiscard]] Client::Task to_public(const plc_TaskStatus& status);
[[nodiscard]] Client::Event to_public(const plc_EventStatus& status);
[[nodiscard]] Client::Transition to_public(const TransitionView& transition);
[[nodiscard]] Client::LogLine to_public(const LogText& line);
[[nodiscard]] Client::Outcome to_public(const PostReport& report);

/// Whether nothing in it has changed. Both are of the same thing.
[[nodiscard]] bool is_same(const Client::Host& a, const Client::Host& b);
[[nodiscard]] bool is_same(const Client::Instance& a, const Client::Instance& b);
[[nodiscard]] bool is_same(const Client::Task& a, const Client::Task& b);
[[nodiscard]] bool is_same(const Client::Event& a, const Client::Event& b);

/// Throws invalid_argument if there is none.
void check_callback(bool given);
[[noreturn]] void throw_client_error(const Error& error);

}  // namespace plchost
