#pragma once

#include <cstddef>
#include <string>

#include <nlohmann/json_fwd.hpp>

namespace plchost {

/// Of Reply.text.
inline constexpr std::size_t kMaxDebugAnswer = 511;

/// The answer to a command of a debugger. If it is too long for a reply, it goes without "file", and then
/// with a shorter "remark".
[[nodiscard]] std::string debug_answer(nlohmann::json answer);

}  // namespace plchost
