#pragma once

#include <optional>
#include <string_view>

#include <nlohmann/json.hpp>

namespace plchost {

/// Levels of an object that another program has sent. Each takes stack when a value is copied or freed.
inline constexpr int kMaxJsonDepth = 32;

/// Nothing: the text is no object of JSON, or it is deeper than kMaxJsonDepth.
[[nodiscard]] std::optional<nlohmann::json> object_in(std::string_view text);

}  // namespace plchost
