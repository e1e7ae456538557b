#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include <nlohmann/json.hpp>

namespace plchost {

/// Nothing: plain_json() makes no object of the text.
[[nodiscard]] std::optional<nlohmann::json> object_in(std::string_view text);

/// A member of such an object; 0, or no text: it is not there, or of another kind.
[[nodiscard]] std::int64_t number_in(const nlohmann::json& arguments, const char* key);
[[nodiscard]] std::string text_in(const nlohmann::json& arguments, const char* key);

}  // namespace plchost
