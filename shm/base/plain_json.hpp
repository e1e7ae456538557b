#pragma once

#include <string_view>

#include <nlohmann/json_fwd.hpp>

namespace plchost {

/// Levels of JSON that another program has written. Each takes stack when a value is copied.
inline constexpr int kMaxJsonDepth = 32;

/// Foreign JSON of texts, flags and integers. Real numbers are left out: to make an integer of a large one is
/// undefined. Discarded: it is no JSON, or deeper than kMaxJsonDepth. Soft threads.
[[nodiscard]] nlohmann::json plain_json(std::string_view text);

}  // namespace plchost
