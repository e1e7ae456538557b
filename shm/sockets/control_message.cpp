#include "shm/sockets/control_message.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace plchost {

namespace {

using Json = nlohmann::json;

std::string dump(const Json& json) {
  // Bytes that are not UTF-8 (a hostile name in an error text) are replaced, never thrown about.
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

Result<Json> parse(std::string_view packet) {
  Json json = Json::parse(packet, nullptr, false);
  if (!json.is_object()) return failure(ErrorCode::corrupt, "control message is not a JSON object");
  const auto version = json.find("version");
  if (version == json.end() || !version->is_number_integer() || *version != kControlVersion) {
    // Only a number is shown: dump() calls itself for each level of nesting, and a hostile text has
    // thousands.
    const bool shown = version != json.end() && version->is_number();
    return failure(ErrorCode::corrupt,
                   fmt::format("control message has {}; expected is version {}",
                               shown ? "version " + dump(*version) : "no version", kControlVersion));
  }
  const auto number = json.find("number");
  if (number == json.end() || !number->is_number_unsigned()) {
    return failure(ErrorCode::corrupt, "control message has no 'number'");
  }
  return json;
}

Result<std::string> text_of(const Json& json, const char* key) {
  const auto found = json.find(key);
  if (found == json.end() || !found->is_string()) {
    return failure(ErrorCode::corrupt, fmt::format("control message has no text '{}'", key));
  }
  return found->get<std::string>();
}

// None: a peer that knows of no options.
Result<std::map<std::string, std::string>> options_of(const Json& json) {
  std::map<std::string, std::string> options;
  const auto found = json.find("options");
  if (found == json.end()) return options;
  if (!found->is_object())
    return failure(ErrorCode::corrupt, "control message has 'options' of a wrong kind");
  for (const auto& [name, value] : found->items()) {
    if (!value.is_string()) {
      return failure(ErrorCode::corrupt, "control message has an option that is no text");
    }
    options.emplace(name, value.get<std::string>());
  }
  return options;
}

// None: a peer that repeats nothing.
Result<std::string> id_of(const Json& json) {
  const auto found = json.find("id");
  if (found == json.end()) return std::string();
  constexpr std::size_t kMost = 100;
  if (!found->is_string() || found->get_ref<const std::string&>().size() > kMost) {
    return failure(ErrorCode::corrupt,
                   fmt::format("control message has an 'id' that is no text of {} bytes at most", kMost));
  }
  return found->get<std::string>();
}

// None: it may be begun at any time.
Result<std::int64_t> limit_of(const Json& json) {
  const auto found = json.find("limit_ns");
  if (found == json.end()) return 0;
  if (!found->is_number_integer())
    return failure(ErrorCode::corrupt, "control message has a 'limit_ns' that is no integer");
  return found->get<std::int64_t>();
}

}  // namespace

Result<void> check_in_time(std::int64_t limit_ns, std::int64_t now_ns) {
  if (limit_ns == 0 || now_ns <= limit_ns) return {};
  constexpr double kNsPerMs = 1e6;
  return failure(ErrorCode::timed_out,
                 fmt::format("not done: it came {:.1f} ms after the time limit of the client",
                             (static_cast<double>(now_ns) - static_cast<double>(limit_ns)) / kNsPerMs));
}

std::string encode(const ControlRequest& request) {
  Json json{{"version", kControlVersion},
            {"number", request.number},
            {"verb", to_string(request.verb)},
            {"instance", request.instance},
            {"argument", request.argument}};
  if (!request.options.empty()) json["options"] = request.options;
  if (request.limit_ns != 0) json["limit_ns"] = request.limit_ns;
  if (!request.id.empty()) json["id"] = request.id;
  return dump(json);
}

std::string encode(const ControlReply& reply) {
  return dump(Json{{"version", kControlVersion},
                   {"number", reply.number},
                   {"code", static_cast<unsigned>(reply.code)},
                   {"text", reply.text}});
}

Result<ControlRequest> decode_request(std::string_view packet) {
  PLCHOST_TRY_ASSIGN(const auto json, parse(packet));
  const auto verb = text_of(json, "verb");
  const auto instance = text_of(json, "instance");
  const auto argument = text_of(json, "argument");
  for (const auto* text : {&verb, &instance, &argument}) PLCHOST_TRY(*text);
  PLCHOST_TRY_ASSIGN(auto options, options_of(json));
  PLCHOST_TRY_ASSIGN(const auto limit, limit_of(json));
  PLCHOST_TRY_ASSIGN(auto id, id_of(json));
  const auto known = std::ranges::find(operations(), *verb, &Operation::name);
  if (known != operations().end()) {
    return ControlRequest{json["number"].get<std::uint64_t>(),
                          known->verb,
                          *instance,
                          *argument,
                          std::move(options),
                          limit,
                          std::move(id)};
  }
  return failure(ErrorCode::corrupt, fmt::format("control message has the unknown verb '{}'", *verb));
}

Result<ControlReply> decode_reply(std::string_view packet) {
  PLCHOST_TRY_ASSIGN(const auto json, parse(packet));
  const auto code = json.find("code");
  constexpr unsigned kLastCode = static_cast<unsigned>(ErrorCode::wrong_size);
  if (code == json.end() || !code->is_number_unsigned() || code->get<std::uint64_t>() > kLastCode) {
    return failure(ErrorCode::corrupt, "control reply has no valid 'code'");
  }
  PLCHOST_TRY_ASSIGN(auto text, text_of(json, "text"));
  return ControlReply{json["number"].get<std::uint64_t>(), static_cast<ErrorCode>(code->get<unsigned>()),
                      std::move(text)};
}

}  // namespace plchost
