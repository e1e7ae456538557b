#include "shm/base/plain_json.hpp"

#include <nlohmann/json.hpp>

namespace plchost {

namespace {

using Json = nlohmann::json;

bool is_too_deep(std::string_view text) noexcept {
  int depth = 0;
  bool in_string = false;
  for (std::size_t at = 0; at < text.size(); ++at) {
    const char c = text[at];
    if (c == '"') {
      in_string = !in_string;
    } else if (in_string) {
      if (c == '\\') ++at;
    } else if (c == '{' || c == '[') {
      if (++depth > kMaxJsonDepth) return true;
    } else if (c == '}' || c == ']') {
      --depth;
    }
  }
  return false;
}

bool is_kept(int /*depth*/, Json::parse_event_t event, const Json& parsed) {
  return event != Json::parse_event_t::value || !parsed.is_number_float();
}

}  // namespace

Json plain_json(std::string_view text) {
  if (is_too_deep(text)) return {Json::value_t::discarded};
  return Json::parse(text, is_kept, /*allow_exceptions=*/false);
}

}  // namespace plchost
