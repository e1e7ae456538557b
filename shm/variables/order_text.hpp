#pragma once

#include <string>
#include <string_view>

namespace plchost {

/// Tells a change of a variable, with its values before and since: "'Main.speed' is written: 5 -> 7".
[[nodiscard]] std::string order_text(std::string_view name, bool forces, std::string_view before,
                                     std::string_view now);
/// Such a text for those who may not read variables: "'Main.speed' is written".
[[nodiscard]] std::string_view without_values(std::string_view order_text) noexcept;

}  // namespace plchost
