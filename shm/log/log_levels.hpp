#pragma once

#include <algorithm>
#include <array>
#include <string_view>

namespace plchost {

/// Names of the log levels, as configuration and command lines have them.
inline constexpr std::array kLogLevels = {std::string_view("trace"), std::string_view("debug"),
                                          std::string_view("info"), std::string_view("warning"),
                                          std::string_view("error")};

[[nodiscard]] constexpr bool is_log_level(std::string_view name) noexcept {
  return std::ranges::find(kLogLevels, name) != kLogLevels.end();
}

}  // namespace plchost
