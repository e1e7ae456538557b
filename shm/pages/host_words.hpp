#pragma once

#include <array>
#include <cstdint>
#include <string_view>

namespace plchost {

// Bounds and words of the configuration that other programs than the manager check, too. They take all that
// its file may say.

/// Domains have UDP ports of their own: 7400 + 250 x domain must stay below 65536.
inline constexpr std::uint32_t kMaxDdsDomain = 230;

/// Of [host] application_limit_mib, MiB.
inline constexpr std::uint32_t kMaxApplicationMib = 1024;

/// The bands of real-time priorities, from the highest.
inline constexpr std::array<std::string_view, 3> kPriorityBandNames = {"high", "normal", "low"};

/// The roles of clients that [host] read_variables and write_variables may name.
inline constexpr std::array<std::string_view, 3> kReaderRoles = {"viewer", "operator", "engineer"};
inline constexpr std::array<std::string_view, 2> kWriterRoles = {"operator", "engineer"};

}  // namespace plchost
