#pragma once

#include <cstdint>
#include <string_view>

#include "shm/base/result.hpp"

namespace plchost::security {

/// The rights of an identity. Each client's role includes the one before it; a host is none of the clients.
enum class Role : std::uint8_t {
  viewer,     ///< reads status
  operating,  ///< "operator": posts events, starts, stops and resets
  engineer,   ///< loads applications, sets schedulers, registers events
  admin,      ///< all that clients can ask for
  host,       ///< plchost-dds of a controller
};

[[nodiscard]] std::string_view to_string(Role role) noexcept;

/// invalid_argument: no role is called so; the text lists them.
[[nodiscard]] Result<Role> parse_role(std::string_view text);

/// True if `role` includes the rights of `needed`.
[[nodiscard]] bool includes(Role role, Role needed) noexcept;

}  // namespace plchost::security
