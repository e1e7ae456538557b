#include "api/cli/debug/foreign_json.hpp"

#include "shm/base/plain_json.hpp"

namespace plchost {

std::optional<nlohmann::json> object_in(std::string_view text) {
  auto object = plain_json(text);
  if (!object.is_object()) return std::nullopt;
  return object;
}

std::int64_t number_in(const nlohmann::json& arguments, const char* key) {
  const auto found = arguments.find(key);
  return found != arguments.end() && found->is_number_integer() ? found->get<std::int64_t>() : 0;
}

std::string text_in(const nlohmann::json& arguments, const char* key) {
  const auto found = arguments.find(key);
  return found != arguments.end() && found->is_string() ? found->get<std::string>() : std::string();
}

}  // namespace plchost
