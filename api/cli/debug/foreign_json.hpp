#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include <nlohmann/json.hpp>

namespace plchost {

/// Levels of an object that another program has sent. Each takes stack when a value is copied or freed.
inline constexpr int kMaxJsonDepth = 32;

/// Nothing: the text is no object of JSON, or it is deeper than kMaxJsonDepth.
[[nodiscard]] std::optional<nlohmann::json> object_in(std::string_view text);

/// A member of such an object; 0, or no text: it is not there, or of another kind.
[[nodiscard]] std::int64_t number_in(const nlohmann::json& arguments, const char* key);
[[nodiscard]] std::string text_in(const nlohmann::json& arguments, const char* key);

}  // namespace plchost
