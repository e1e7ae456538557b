#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include <control.h>

#include "api/dds/topic_info.hpp"
#include "api/security/role.hpp"
#include "shm/operations/operations.hpp"
#include "shm/sockets/control_message.hpp"

namespace plchost {

/// A request as it came from the network, turned into the manager's. `number` is left 0. Every error names
/// what was wrong and, where there is a list, what is allowed. not_found: another host, or no such instance;
/// unsupported: unknown operation; refused: not in this role; invalid_argument: a name or argument that
/// cannot be.
[[nodiscard]] Result<ControlRequest> check_request(const plc_Request& request, ApiRole role,
                                                   std::string_view host,
                                                   std::span<const std::string_view> instances);

/// The topic that the operations of that role are written to, and the role that an identity needs for it.
[[nodiscard]] const dds::TopicInfo& request_topic(ApiRole role) noexcept;
[[nodiscard]] security::Role role_of(ApiRole role) noexcept;

/// An operation that changes nothing, by its number.
[[nodiscard]] bool only_reads(std::int32_t operation) noexcept;
/// Its name; "operation N" if there is none of that number.
[[nodiscard]] std::string operation_name(std::int32_t operation);

/// DDS-RPC's own code for the reply's header.
[[nodiscard]] std::int32_t remote_exception(ErrorCode code) noexcept;

}  // namespace plchost
