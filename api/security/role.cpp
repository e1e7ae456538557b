#include "api/security/role.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include <fmt/format.h>

#include "shm/base/names.hpp"

namespace plchost::security {

namespace {

constexpr std::array<std::string_view, 5> kRoles{"viewer", "operator", "engineer", "admin", "host"};

}  // namespace

std::string_view to_string(Role role) noexcept {
  return kRoles[std::to_underlying(role)];
}

Result<Role> parse_role(std::string_view text) {
  const auto* const found = std::ranges::find(kRoles, text);
  if (found != kRoles.end()) return static_cast<Role>(found - kRoles.begin());
  const auto near = nearest_name(text, kRoles);
  return failure(
      ErrorCode::invalid_argument,
      fmt::format("no role is called '{}'{}; there are: {}", shown(text),
                  near.empty() ? "" : fmt::format(" (did you mean '{}'?)", near), join_names(kRoles)));
}

bool includes(Role role, Role needed) noexcept {
  if (role == Role::host || needed == Role::host) return role == needed;
  return role >= needed;
}

}  // namespace plchost::security
